"""Managed nodes, which clients configure, activate, deactivate, clean up and shut down (lifecycle_msgs).

A transition leads from a primary state such as UNCONFIGURED through a transition state such as CONFIGURING
to the goal state. The node carries out the transition while it is in the transition state, and publishes both
changes of its state.
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
from cxbridge_ros2.stamps import NS_PER_US

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
    """The outcome of a transition; its value is the offset from the number in :data:`_SUCCESS_NUMBERS`."""

    SUCCESS = 0
    FAILURE = 1
    ERROR = 2

    @property
    def label(self) -> str:
        return f"transition_{self.name.lower()}"


# the names of transitions
CONFIGURE, CLEANUP, ACTIVATE, DEACTIVATE = "configure", "cleanup", "activate", "deactivate"
SHUTDOWN: Final = "shutdown"


class _Transition(Struct, frozen=True):
    """A transition that clients can request.

    :param number: the number of the transition in lifecycle_msgs/msg/Transition.
    """

    number: int
    name: str
    start_state: LifecycleState
    transition_state: LifecycleState
    goal_state: LifecycleState


_TRANSITIONS: Final = tuple(
    _Transition(
        number,
        name,
        LifecycleState[start_state],
        LifecycleState[transition_state],
        LifecycleState[goal_state],
    )
    for number, name, start_state, transition_state, goal_state in (
        (1, CONFIGURE, "UNCONFIGURED", "CONFIGURING", "INACTIVE"),
        (2, CLEANUP, "INACTIVE", "CLEANINGUP", "UNCONFIGURED"),
        (3, ACTIVATE, "INACTIVE", "ACTIVATING", "ACTIVE"),
        (4, DEACTIVATE, "ACTIVE", "DEACTIVATING", "INACTIVE"),
        (5, SHUTDOWN, "UNCONFIGURED", "SHUTTINGDOWN", "FINALIZED"),
        (6, SHUTDOWN, "INACTIVE", "SHUTTINGDOWN", "FINALIZED"),
        (7, SHUTDOWN, "ACTIVE", "SHUTTINGDOWN", "FINALIZED"),
    )
)
# The number in lifecycle_msgs/msg/Transition of the successful end of each transition state.
_SUCCESS_NUMBERS: Final = {
    LifecycleState.CONFIGURING: 10,
    LifecycleState.CLEANINGUP: 20,
    LifecycleState.ACTIVATING: 30,
    LifecycleState.DEACTIVATING: 40,
    LifecycleState.SHUTTINGDOWN: 50,
    LifecycleState.ERRORPROCESSING: 60,
}

# Carries out a transition, and returns whether it has succeeded. An exception is an error of the transition.
TransitionCallback = Callable[[], bool]


class Lifecycle(Closing):
    """The lifecycle of a node, with its services and topic.

    :param name: the node's name without the slash.
    :param callbacks: functions by transition. A transition without a function succeeds; an exception
        finalizes the node.
    :param report_error: called with a text about each exception.
    :param state: the initial state.
    :ivar state: the current state.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        callbacks: Mapping[str, TransitionCallback],
        clock: Clock,
        report_error: Callable[[str], None],
        state: LifecycleState = LifecycleState.UNCONFIGURED,
    ) -> None:
        self._callbacks, self._clock, self._report_error = callbacks, clock, report_error
        self.state = state
        services: dict[str, tuple[str, Callable[[Message], Mapping[str, Any]]]] = {
            "change_state": ("ChangeState", self._change_state),
            "get_state": ("GetState", lambda _request: {"current_state": self.state.message}),
            "get_available_states": (
                "GetAvailableStates",
                lambda _request: {"available_states": [state.message for state in LifecycleState]},
            ),
            "get_available_transitions": (
                "GetAvailableTransitions",
                lambda _request: {
                    "available_transitions": [*_describe_first_changes(self._available_transitions)]
                },
            ),
            "get_transition_graph": ("GetAvailableTransitions", self._get_transition_graph),
        }
        self._close_functions = [
            node.serve(
                f"/{name}/{service}",
                f"{_PACKAGE}/srv/{service_type}",
                handler,
                right=right_of_frame("ros2-lifecycle", service),
            )
            for service, (service_type, handler) in services.items()
        ]
        self._event_publisher = node.create_publisher(
            f"/{name}/transition_event", f"{_PACKAGE}/msg/TransitionEvent", PROFILES["default"]
        )

    def request_transition(self, name: str) -> bool:
        """Carry out a transition like a client's request; return whether it has succeeded.

        A transition that does not begin in the current state fails without an effect.
        """
        transitions = {transition.name: transition for transition in self._available_transitions}
        if name not in transitions:
            return False
        self._enter_state(transitions[name].number, name, transitions[name].transition_state)
        outcome = self._call_callback(name)
        self._end_transition(outcome)
        if outcome is TransitionOutcome.ERROR:
            # ERRORPROCESSING fails, as the default error handler of rclcpp does
            self._end_transition(TransitionOutcome.FAILURE)
        return outcome is TransitionOutcome.SUCCESS

    def report_state(self, state: LifecycleState) -> None:
        """Report that a primary state was reached without a request to this lifecycle.

        Does nothing if the node is in this state, or no transition leads there from the current state.
        """
        transition = next(
            (transition for transition in self._available_transitions if transition.goal_state is state), None
        )
        if transition is not None:
            self._enter_state(transition.number, transition.name, transition.transition_state)
            self._end_transition(TransitionOutcome.SUCCESS)

    @property
    def _available_transitions(self) -> Iterator[_Transition]:
        return (transition for transition in _TRANSITIONS if transition.start_state is self.state)

    def _call_callback(self, name: str) -> TransitionOutcome:
        try:
            has_succeeded = self._callbacks[name]() if name in self._callbacks else True
        except Exception as error:  # noqa: BLE001 - any exception is an error of the transition
            self._report_error(f"{name} has failed: {error}")
            return TransitionOutcome.ERROR
        return TransitionOutcome.SUCCESS if has_succeeded else TransitionOutcome.FAILURE

    def _end_transition(self, outcome: TransitionOutcome) -> None:
        """Go from the current transition state to the primary state after an outcome."""
        goal_state = _find_end_states(self.state)[outcome]
        self._enter_state(_SUCCESS_NUMBERS[self.state] + outcome, outcome.label, goal_state)

    def _enter_state(self, number: int, label: str, goal_state: LifecycleState) -> None:
        start_state, self.state = self.state, goal_state
        timestamp = self._clock.now_us() * NS_PER_US
        self._event_publisher.publish(
            {"timestamp": timestamp, **_make_description(number, label, start_state, goal_state)}
        )

    # --- services -----------------------------------------------------------------------------------------

    def _change_state(self, request: Message) -> Mapping[str, Any]:
        requested_transition = request["transition"]
        # a client names the transition by its label, or by its number and an empty label
        names = (
            transition.name for transition in _TRANSITIONS if transition.number == requested_transition["id"]
        )
        return {"success": self.request_transition(requested_transition["label"] or next(names, ""))}

    def _get_transition_graph(self, _request: Message) -> Mapping[str, Any]:
        end_descriptions = (
            _make_description(
                number + outcome, outcome.label, transition_state, _find_end_states(transition_state)[outcome]
            )
            for transition_state, number in _SUCCESS_NUMBERS.items()
            for outcome in TransitionOutcome
        )
        return {"available_transitions": [*_describe_first_changes(_TRANSITIONS), *end_descriptions]}

    def close(self) -> None:
        for close_endpoint in (*self._close_functions, self._event_publisher.close):
            close_endpoint()


def _find_end_states(
    transition_state: LifecycleState,
) -> tuple[LifecycleState, LifecycleState, LifecycleState]:
    """Return the states after a transition state: for SUCCESS, FAILURE and ERROR."""
    if transition_state is LifecycleState.ERRORPROCESSING:
        return LifecycleState.UNCONFIGURED, LifecycleState.FINALIZED, LifecycleState.FINALIZED
    transition = next(
        transition for transition in _TRANSITIONS if transition.transition_state is transition_state
    )
    # a node that fails to shut down is finalized all the same
    is_final = transition.goal_state is LifecycleState.FINALIZED
    failure_state = LifecycleState.FINALIZED if is_final else transition.start_state
    return transition.goal_state, failure_state, LifecycleState.ERRORPROCESSING


def _describe_first_changes(transitions: Iterable[_Transition]) -> Iterator[Message]:
    """Yield the description of each transition's change from its start state to its transition state."""
    for transition in transitions:
        yield _make_description(
            transition.number, transition.name, transition.start_state, transition.transition_state
        )


def _make_description(
    number: int, label: str, start_state: LifecycleState, goal_state: LifecycleState
) -> Message:
    """Return a lifecycle_msgs/msg/TransitionDescription."""
    return {
        "transition": {"id": number, "label": label},
        "start_state": start_state.message,
        "goal_state": goal_state.message,
    }
