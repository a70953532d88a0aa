"""Managed nodes, whose clients configure, activate, deactivate, clean up and shut down (lifecycle_msgs)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from enum import IntEnum
from typing import Any, Final

from cxbridge.clock import Clock
from cxbridge.closing import Closing
from cxbridge.rights import right_of_frame
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import PROFILES

_PACKAGE: Final = "lifecycle_msgs"
_NANOSECONDS: Final = 1000  # per microsecond


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
    def label(self) -> str:
        return self.name.lower()


class TransitionOutcome(IntEnum):
    """The result of a transition, as offset from the transition's number."""

    SUCCESS = 0
    FAILURE = 1
    ERROR = 2


_LABELS: Final = {
    TransitionOutcome.SUCCESS: "transition_success",
    TransitionOutcome.FAILURE: "transition_failure",
    TransitionOutcome.ERROR: "transition_error",
}

# names of the transitions that a node implements
CONFIGURE, CLEANUP, ACTIVATE, DEACTIVATE = "configure", "cleanup", "activate", "deactivate"
SHUTDOWN: Final = "shutdown"
ERROR: Final = "error"

# number, name, start state, transition state, goal state
_ORDERS: Final = (
    (1, CONFIGURE, LifecycleState.UNCONFIGURED, LifecycleState.CONFIGURING, LifecycleState.INACTIVE),
    (2, CLEANUP, LifecycleState.INACTIVE, LifecycleState.CLEANINGUP, LifecycleState.UNCONFIGURED),
    (3, ACTIVATE, LifecycleState.INACTIVE, LifecycleState.ACTIVATING, LifecycleState.ACTIVE),
    (4, DEACTIVATE, LifecycleState.ACTIVE, LifecycleState.DEACTIVATING, LifecycleState.INACTIVE),
    (5, SHUTDOWN, LifecycleState.UNCONFIGURED, LifecycleState.SHUTTINGDOWN, LifecycleState.FINALIZED),
    (6, SHUTDOWN, LifecycleState.INACTIVE, LifecycleState.SHUTTINGDOWN, LifecycleState.FINALIZED),
    (7, SHUTDOWN, LifecycleState.ACTIVE, LifecycleState.SHUTTINGDOWN, LifecycleState.FINALIZED),
)
# Number of the successful transition out of each transition state.
_ENDS: Final = {
    LifecycleState.CONFIGURING: 10,
    LifecycleState.CLEANINGUP: 20,
    LifecycleState.ACTIVATING: 30,
    LifecycleState.DEACTIVATING: 40,
    LifecycleState.SHUTTINGDOWN: 50,
    LifecycleState.ERRORPROCESSING: 60,
}

# Carries out a transition and returns its success. An exception is an error.
Work = Callable[[], bool]


def _nothing() -> bool:
    return True


class Lifecycle(Closing):
    """The lifecycle of a node, with its services and topic.

    :param name: the node's name without the slash.
    :param work: functions by transition; a missing function does nothing. :data:`ERROR` is called after an
        exception, and the node is finalized unless it returns True.
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
        self._ends = [
            node.serve(
                f"/{name}/{service}",
                f"{_PACKAGE}/srv/{kind}",
                answer,
                needs=right_of_frame("ros2-lifecycle", service),
            )
            for service, (kind, answer) in services.items()
        ]
        self._events = node.publisher(
            f"/{name}/transition_event", f"{_PACKAGE}/msg/TransitionEvent", PROFILES["default"]
        )

    def change(self, name: str) -> bool:
        """Carry out a transition as on a client's request, and return its success."""
        order = next((each for each in _ORDERS if each[1] == name and each[2] is self.state), None)
        if order is None:
            return False
        number, _, start, during, goal = order
        self._move(number, name, during)
        outcome = self._carry_out(name)
        fallback = LifecycleState.FINALIZED if during is LifecycleState.SHUTTINGDOWN else start
        self._leave_transition(
            {
                TransitionOutcome.SUCCESS: goal,
                TransitionOutcome.FAILURE: fallback,
                TransitionOutcome.ERROR: LifecycleState.ERRORPROCESSING,
            },
            outcome,
        )
        if outcome is TransitionOutcome.ERROR:
            recovered = self._carry_out(ERROR) if ERROR in self._work else TransitionOutcome.FAILURE
            self._leave_transition({TransitionOutcome.SUCCESS: LifecycleState.UNCONFIGURED}, recovered)
        return outcome is TransitionOutcome.SUCCESS

    def _leave_transition(
        self, goals: Mapping[TransitionOutcome, LifecycleState], outcome: TransitionOutcome
    ) -> None:
        number = _ENDS[self.state] + outcome
        self._move(number, _LABELS[outcome], goals.get(outcome, LifecycleState.FINALIZED))

    def follow(self, state: LifecycleState) -> None:
        """Report a transition that was carried out in another way than over lifecycle_msgs."""
        order = next((each for each in _ORDERS if each[2] is self.state and each[4] is state), None)
        if order is not None:
            self._move(order[0], order[1], order[3])
            self._leave_transition({TransitionOutcome.SUCCESS: state}, TransitionOutcome.SUCCESS)

    def _carry_out(self, name: str) -> TransitionOutcome:
        try:
            return (
                TransitionOutcome.SUCCESS if self._work.get(name, _nothing)() else TransitionOutcome.FAILURE
            )
        except Exception as error:  # noqa: BLE001 - any exception is an error of the transition
            self._report(f"{name} has failed: {error}")
            return TransitionOutcome.ERROR

    def _move(self, number: int, label: str, goal: LifecycleState) -> None:
        start, self.state = self.state, goal
        self._events.publish(
            {
                "timestamp": self._clock.now_us() * _NANOSECONDS,
                "transition": {"id": number, "label": label},
                "start_state": _state(start),
                "goal_state": _state(goal),
            }
        )

    # --- services -----------------------------------------------------------------------------------------

    def _change(self, request: Message) -> Mapping[str, Any]:
        transition = request["transition"]
        name = transition["label"] or next(
            (order[1] for order in _ORDERS if order[0] == transition["id"]), ""
        )
        return {"success": self.change(name)}

    def _get_state(self, _request: Message) -> Mapping[str, Any]:
        return {"current_state": _state(self.state)}

    def _get_states(self, _request: Message) -> Mapping[str, Any]:
        return {"available_states": [_state(each) for each in LifecycleState]}

    def _get_transitions(self, _request: Message) -> Mapping[str, Any]:
        return {"available_transitions": [_order(each) for each in _ORDERS if each[2] is self.state]}

    def _get_graph(self, _request: Message) -> Mapping[str, Any]:
        return {"available_transitions": [*map(_order, _ORDERS), *_ends()]}

    def close(self) -> None:
        for end in self._ends:
            end()
        self._events.close()


def _state(state: LifecycleState) -> Mapping[str, Any]:
    return {"id": int(state), "label": state.label}


def _order(order: tuple[int, str, LifecycleState, LifecycleState, LifecycleState]) -> Mapping[str, Any]:
    number, name, start, during, _ = order
    return {
        "transition": {"id": number, "label": name},
        "start_state": _state(start),
        "goal_state": _state(during),
    }


def _ends() -> Iterator[Mapping[str, Any]]:
    """Yield the transitions that follow automatically."""
    outcomes = {during: (goal, start) for _, _, start, during, goal in _ORDERS}
    outcomes[LifecycleState.SHUTTINGDOWN] = (LifecycleState.FINALIZED, LifecycleState.FINALIZED)
    outcomes[LifecycleState.ERRORPROCESSING] = (LifecycleState.UNCONFIGURED, LifecycleState.FINALIZED)
    for during, (goal, fallback) in outcomes.items():
        error_state = (
            LifecycleState.FINALIZED
            if during is LifecycleState.ERRORPROCESSING
            else LifecycleState.ERRORPROCESSING
        )
        for outcome, end in zip(TransitionOutcome, (goal, fallback, error_state), strict=True):
            yield {
                "transition": {"id": _ENDS[during] + outcome, "label": _LABELS[outcome]},
                "start_state": _state(during),
                "goal_state": _state(end),
            }
