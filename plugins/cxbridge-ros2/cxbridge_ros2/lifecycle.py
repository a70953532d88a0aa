"""Managed nodes, whose clients configure, activate, deactivate, clean up and shut down (lifecycle_msgs).

A transition leads from a primary state through a transition state, such as CONFIGURING, to the goal state; it
is carried out while the node is in the transition state. Each of the two changes of state is published.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import IntEnum
from typing import Any, Final

from msgspec import Struct

from cxbridge.clock import Clock
from cxbridge.closing import Closing
from cxbridge.rights import right_of_frame
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.stamps import NANOSECONDS

_PACKAGE: Final = "lifecycle_msgs"


class LifecycleState(IntEnum):
    """lifecycle_msgs/msg/State: five primary states, then the transition states."""

    UNKNOWN = 0
    UNCONFIGURED = 1
    INACTIVE = 2
    ACTIVE = 3
    FINALIZED = 4
    CONFIGURING = 10
    CLEANINGUP = 11
    SHUTTINGDOWN = 12
    ACTIVATING = 13
    DEACTIVATING = 14
    ERRORPROCESSING = 15

    @property
    def message(self) -> Message:
        return {"id": int(self), "label": self.name.lower()}


class TransitionOutcome(IntEnum):
    """The result of a transition, as offset from the number in :data:`_END_NUMBERS`."""

    SUCCESS = 0
    FAILURE = 1
    ERROR = 2

    @property
    def label(self) -> str:
        return f"transition_{self.name.lower()}"


# names of the transitions that a node implements
CONFIGURE, CLEANUP, ACTIVATE, DEACTIVATE = "configure", "cleanup", "activate", "deactivate"
SHUTDOWN: Final = "shutdown"


class _Transition(Struct, frozen=True):
    """A transition on a client's request.

    :param number: the number of the transition in lifecycle_msgs/msg/Transition.
    :param during: the transition state.
    """

    number: int
    name: str
    start: LifecycleState
    during: LifecycleState
    goal: LifecycleState


_TRANSITIONS: Final = tuple(
    _Transition(number, name, LifecycleState[start], LifecycleState[during], LifecycleState[goal])
    for number, name, start, during, goal in (
        (1, CONFIGURE, "UNCONFIGURED", "CONFIGURING", "INACTIVE"),
        (2, CLEANUP, "INACTIVE", "CLEANINGUP", "UNCONFIGURED"),
        (3, ACTIVATE, "INACTIVE", "ACTIVATING", "ACTIVE"),
        (4, DEACTIVATE, "ACTIVE", "DEACTIVATING", "INACTIVE"),
        (5, SHUTDOWN, "UNCONFIGURED", "SHUTTINGDOWN", "FINALIZED"),
        (6, SHUTDOWN, "INACTIVE", "SHUTTINGDOWN", "FINALIZED"),
        (7, SHUTDOWN, "ACTIVE", "SHUTTINGDOWN", "FINALIZED"),
    )
)
# number of the successful transition out of each transition state
_END_NUMBERS: Final = {
    LifecycleState.CONFIGURING: 10,
    LifecycleState.CLEANINGUP: 20,
    LifecycleState.ACTIVATING: 30,
    LifecycleState.DEACTIVATING: 40,
    LifecycleState.SHUTTINGDOWN: 50,
    LifecycleState.ERRORPROCESSING: 60,
}

# carries out a transition and returns its success; an exception is an error
Work = Callable[[], bool]


class Lifecycle(Closing):
    """The lifecycle of a node, with its services and topic.

    :param name: the node's name without the slash.
    :param work: functions by transition; a missing function does nothing. An exception finalizes the node.
    :param report: called with a line about each exception.
    :param state: the initial state.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        work: Mapping[str, Work],
        clock: Clock,
        report: Callable[[str], None],
        state: LifecycleState = LifecycleState.UNCONFIGURED,
    ) -> None:
        self._work, self._clock, self._report = work, clock, report
        self.state = state
        services: dict[str, tuple[str, Callable[[Message], Mapping[str, Any]]]] = {
            "change_state": ("ChangeState", self._change),
            "get_state": ("GetState", self._get_state),
            "get_available_states": ("GetAvailableStates", self._get_states),
            "get_available_transitions": ("GetAvailableTransitions", self._get_transitions),
            "get_transition_graph": ("GetAvailableTransitions", self._get_graph),
        }
        self._closers = [
            node.serve(
                f"/{name}/{service}",
                f"{_PACKAGE}/srv/{kind}",
                handler,
                needs=right_of_frame("ros2-lifecycle", service),
            )
            for service, (kind, handler) in services.items()
        ]
        self._events = node.publisher(
            f"/{name}/transition_event", f"{_PACKAGE}/msg/TransitionEvent", PROFILES["default"]
        )

    def change(self, name: str) -> bool:
        """Carry out a transition as on a client's request, and return its success."""
        transition = next((item for item in self._available if item.name == name), None)
        if transition is None:
            return False
        self._move(transition.number, name, transition.during)
        outcome = self._carry_out(name)
        self._end_transition(outcome)
        if outcome is TransitionOutcome.ERROR:
            # ERRORPROCESSING fails, as in rclcpp without an error handler
            self._end_transition(TransitionOutcome.FAILURE)
        return outcome is TransitionOutcome.SUCCESS

    def follow(self, state: LifecycleState) -> None:
        """Report a transition that was carried out in another way than over lifecycle_msgs."""
        transition = next((item for item in self._available if item.goal is state), None)
        if transition is not None:
            self._move(transition.number, transition.name, transition.during)
            self._end_transition(TransitionOutcome.SUCCESS)

    @property
    def _available(self) -> Iterator[_Transition]:
        return (transition for transition in _TRANSITIONS if transition.start is self.state)

    def _carry_out(self, name: str) -> TransitionOutcome:
        try:
            succeeded = self._work[name]() if name in self._work else True
        except Exception as error:  # noqa: BLE001 - any exception is an error of the transition
            self._report(f"{name} has failed: {error}")
            return TransitionOutcome.ERROR
        return TransitionOutcome.SUCCESS if succeeded else TransitionOutcome.FAILURE

    def _end_transition(self, outcome: TransitionOutcome) -> None:
        """Leave the current transition state."""
        goal = _end_states(self.state)[outcome]
        self._move(_END_NUMBERS[self.state] + outcome, outcome.label, goal)

    def _move(self, number: int, label: str, goal: LifecycleState) -> None:
        start, self.state = self.state, goal
        timestamp = self._clock.now_us() * NANOSECONDS
        self._events.publish({"timestamp": timestamp, **_description(number, label, start, goal)})

    # --- services -----------------------------------------------------------------------------------------

    def _change(self, request: Message) -> Mapping[str, Any]:
        requested = request["transition"]
        # a client names the transition by its label or by its number
        names = (transition.name for transition in _TRANSITIONS if transition.number == requested["id"])
        return {"success": self.change(requested["label"] or next(names, ""))}

    def _get_state(self, _request: Message) -> Mapping[str, Any]:
        return {"current_state": self.state.message}

    def _get_states(self, _request: Message) -> Mapping[str, Any]:
        return {"available_states": [state.message for state in LifecycleState]}

    def _get_transitions(self, _request: Message) -> Mapping[str, Any]:
        return {"available_transitions": [*_describe_starts(self._available)]}

    def _get_graph(self, _request: Message) -> Mapping[str, Any]:
        ends = (
            _description(number + outcome, outcome.label, during, _end_states(during)[outcome])
            for during, number in _END_NUMBERS.items()
            for outcome in TransitionOutcome
        )
        return {"available_transitions": [*_describe_starts(_TRANSITIONS), *ends]}

    def close(self) -> None:
        for end in self._closers:
            end()
        self._events.close()


def _end_states(during: LifecycleState) -> tuple[LifecycleState, LifecycleState, LifecycleState]:
    """Return the states after success, failure and an error in a transition state."""
    if during is LifecycleState.ERRORPROCESSING:
        return LifecycleState.UNCONFIGURED, LifecycleState.FINALIZED, LifecycleState.FINALIZED
    transition = next(item for item in _TRANSITIONS if item.during is during)
    # a node that fails to shut down is finalized all the same
    is_final = transition.goal is LifecycleState.FINALIZED
    failed = LifecycleState.FINALIZED if is_final else transition.start
    return transition.goal, failed, LifecycleState.ERRORPROCESSING


def _describe_starts(transitions: Iterable[_Transition]) -> Iterator[Message]:
    for transition in transitions:
        yield _description(transition.number, transition.name, transition.start, transition.during)


def _description(number: int, label: str, start: LifecycleState, goal: LifecycleState) -> Message:
    """Return a lifecycle_msgs/msg/TransitionDescription."""
    return {
        "transition": {"id": number, "label": label},
        "start_state": start.message,
        "goal_state": goal.message,
    }
