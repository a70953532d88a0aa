"""A client's side of SkillerInterface: acquires control, sends a skill string, waits for its end.

The methods ``..._steps`` are generators that receive the changes of the interface and yield a time limit for
the next change. Thus the same steps serve a blocking command (:meth:`SkillerCall.execute`) and a caller in a
main loop (:meth:`SkillerCall.poll`).
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeAlias, TypeVar

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.exclusive_control import describe_controller, skip_stale_ids
from cxbridge.blackboard.following import Deadline, Feed, InterfaceChange
from cxbridge.blackboard.stale_errors import ErrorTracker
from cxbridge.closing import Closing
from cxbridge.errors import BlackBoardError, SkillerError
from cxbridge.interfaces.instance import Interface

OWNER = "cxbridge skill"
SKILLER_TYPE = "SkillerInterface"
CONTROL_TIMEOUT_S = 5.0
"""The seconds in which a Skiller must grant control: many loops, although a Skiller needs only one."""

RELEASE_TIMEOUT_S = 0.5
"""The seconds in which another client must release control: the Skiller handles the message of an ending
client only in its next loop."""

ResultT = TypeVar("ResultT")
# Receives interface changes; yields the time limit for the next change, None for the caller's limit.
_Steps: TypeAlias = Generator[Deadline | None, InterfaceChange | None, ResultT]

_RUNNING, _FINAL, _FAILED = "S_RUNNING", "S_FINAL", "S_FAILED"


class CallOutcome(Enum):
    """The outcome of a skill string; its value is the exit status of the command."""

    FINAL = 0
    FAILED = 1
    TIMED_OUT = 3


@dataclass(frozen=True, slots=True)
class SkillResult:
    """The result of a skill string.

    :param error: the reason for a failure, otherwise empty.
    :param msgid: the id of the ExecSkillMessage; 0 if no message was sent.
    """

    outcome: CallOutcome
    error: str
    msgid: int


class SkillerCall(Closing):
    """Executes skill strings under exclusive control, which a context manager releases.

    :param skiller: the id of the Skiller's interface.
    :param steal: take control even from another client.
    :param on_status: called with each status of the skill string and the Skiller's error.
    :raises SkillerError: if the Skiller does not exist.
    :raises BlackBoardError: if the interface cannot be opened.
    """

    def __init__(
        self,
        board: BlackBoard,
        *,
        skiller: str = "Skiller",
        steal: bool = False,
        on_status: Callable[[str, str], None] = lambda _status, _error: None,
    ) -> None:
        self._steal, self._on_status = steal, on_status
        self._feed = Feed(board, OWNER)
        self._interface: Interface = self._feed.open(SKILLER_TYPE, skiller)
        self._has_control = self._is_running = False
        self._msgid = 0
        if not self._interface.has_writer:
            self._feed.close()
            raise SkillerError(
                f"no Skiller writes {SKILLER_TYPE}::{skiller}",
                hint="is the Skiller running? see 'cxbridge skill list'",
            )

    def execute(self, skill_string: str, timeout_s: float | None = None) -> SkillResult:
        """Execute a skill string until it ends; stop it after the timeout.

        :param timeout_s: seconds of real time; None: no limit.
        :raises BlackBoardError: if a message cannot be sent.
        """
        result = self._complete(self._execution_steps(skill_string), Deadline(timeout_s))
        if result is None:
            self.stop()
            return SkillResult(CallOutcome.TIMED_OUT, f"not finished after {timeout_s:g} s", self._msgid)
        return result

    def poll(self, skill_string: str) -> Generator[None, None, SkillResult]:
        """Execute a skill string without blocking: yield as long as the skill string runs.

        :returns: the result.
        :raises BlackBoardError: if a message cannot be sent.
        """
        steps = self._execution_steps(skill_string)
        try:
            limit = next(steps)
            while True:
                change = self._feed.wait_for_change(Deadline(0))
                if change is None and (limit is None or limit.remaining_s()):
                    yield
                else:
                    limit = steps.send(change)
        except StopIteration as end:
            result: SkillResult = end.value
            return result

    def start(self, skill_string: str) -> int:
        """Start a skill string and return the id of its message.

        :meth:`close` releases control, but does not stop the skill string.

        :raises SkillerError: if another client has control, or the Skiller does not grant control.
        :raises BlackBoardError: if a message cannot be sent.
        """
        refusal = self._complete(self._control_steps(), Deadline(None))
        if refusal:
            raise SkillerError(refusal)
        skip_stale_ids(self._interface, may_control=True)
        return _send(self._interface, "ExecSkillMessage", skill_string=skill_string)

    def stop(self) -> None:
        """Stop the skill string.

        :raises BlackBoardError: if the message cannot be sent.
        """
        self._is_running = False
        _send(self._interface, "StopExecMessage")

    def close(self) -> None:
        """Stop a running skill string, release control, close the interface."""
        # the messages are sent without a wait for their effect: the Skiller may be gone
        try:
            if self._interface.valid and self._interface.has_writer:
                if self._is_running:
                    self.stop()
                if self._has_control:
                    _send(self._interface, "ReleaseControlMessage")
        except BlackBoardError:
            pass  # the Skiller has just ended
        self._feed.close()

    def _complete(self, steps: _Steps[ResultT], deadline: Deadline) -> ResultT | None:
        """Feed interface changes to the steps; return their result, or None after the deadline."""
        try:
            limit = next(steps)
            while (change := self._feed.wait_for_change(limit or deadline)) is not None or limit is not None:
                limit = steps.send(change)
        except StopIteration as end:
            result: ResultT = end.value
            return result
        return None

    def _execution_steps(self, skill_string: str) -> _Steps[SkillResult]:
        refusal = yield from self._control_steps()
        if refusal:
            return SkillResult(CallOutcome.FAILED, refusal, 0)
        skip_stale_ids(self._interface, may_control=True)
        former_state = self._feed.read_state(self._interface)
        self._msgid = _send(self._interface, "ExecSkillMessage", skill_string=skill_string)
        self._is_running = True
        result = yield from self._outcome_steps(self._msgid, skill_string, former_state)
        self._is_running = False
        return result

    def _control_steps(self) -> _Steps[str]:
        """Acquire control; return the reason for a failure, or an empty text."""
        own_serial = str(self._interface.serial)
        change: InterfaceChange | None = self._feed.read_state(self._interface)
        assert change is not None
        deadline = Deadline(RELEASE_TIMEOUT_S)
        accepted_controllers = ("", own_serial)
        while (
            controller := change.values["exclusive_controller"]
        ) not in accepted_controllers and not self._steal:
            change = yield deadline
            if change is None:
                name = describe_controller(self._interface, controller)
                return f"{name} has control of the Skiller; --steal takes it"
        _send(self._interface, "AcquireControlMessage", steal_control=self._steal)
        deadline = Deadline(CONTROL_TIMEOUT_S)
        while change is not None and change.values["exclusive_controller"] != own_serial:
            change = yield deadline
        self._has_control = change is not None
        return (
            "" if self._has_control else f"the Skiller did not grant control within {CONTROL_TIMEOUT_S:g} s"
        )

    def _describe_loss(self, controller: str) -> str:
        """Return the reason for the loss of control."""
        if not controller and not self._interface.has_writer:
            return "the Skiller is gone"
        return f"control of the Skiller was lost to {describe_controller(self._interface, controller)}"

    def _outcome_steps(
        self, msgid: int, skill_string: str, former_state: InterfaceChange
    ) -> _Steps[SkillResult]:
        """Wait for the end of a message's skill string.

        :param former_state: the state at the time of sending, which may show the same id of an earlier
            caller.
        """
        own_serial, is_accepted, reported_status = str(self._interface.serial), False, ""
        error_tracker = ErrorTracker(former_state.values["msgid"], former_state.values["error"])
        while True:
            change = yield None
            assert change is not None  # yield None sets no limit
            values = change.values
            status = getattr(values["status"], "name", str(values["status"]))
            if change.kind == "writer removed":
                return SkillResult(CallOutcome.FAILED, "the Skiller is gone", msgid)
            # the feed may still deliver earlier states, and the state at the time of sending
            if change.time_us < former_state.time_us or (
                change.time_us == former_state.time_us and values == former_state.values
            ):
                continue
            shown_string = values["skill_string"]
            # the field cuts long skill strings, so the call may be longer; no skill string begins with "?"
            is_replaced = values["msgid"] == msgid and not skill_string.startswith(shown_string or "?")
            has_ended = values["msgid"] == msgid and not is_replaced and status in (_FINAL, _FAILED)
            # each client counts ids separately: a state under another controller belongs to the call of that
            # client, even if id and skill string are the same
            if (controller := values["exclusive_controller"]) != own_serial:
                self._has_control = False
                # without a controller this call is over, too; a stopping Skiller shows it as failed
                if controller or not has_ended:
                    return SkillResult(CallOutcome.FAILED, self._describe_loss(controller), msgid)
            if values["msgid"] != msgid or is_replaced:
                if is_accepted or is_replaced:
                    reason = (
                        f"the skill string was replaced by '{shown_string}'"
                        if shown_string
                        else "the skill string was stopped"
                    )
                    return SkillResult(CallOutcome.FAILED, reason, msgid)
                continue
            is_accepted = True
            error = error_tracker.update(msgid, shown_string, values["error"], failed=status == _FAILED)
            if status != reported_status:
                reported_status = status
                self._on_status(status, error)
            if status != _RUNNING:
                return _make_result(status, error, msgid)


def _make_result(status: str, error: str, msgid: int) -> SkillResult:
    if status == _FINAL:
        return SkillResult(CallOutcome.FINAL, "", msgid)
    if not error and status == _FAILED:
        error = "the Skiller gives no reason"
    return SkillResult(CallOutcome.FAILED, error or "the skill string called no skill, or was stopped", msgid)


def request_skill_names(board: BlackBoard, skiller: str, timeout_s: float) -> list[str] | None:
    """Return the skills of a Skiller, requested as Fawkes' viewer skillgui does.

    :returns: the names; None without reply, or if an agent on the skill board has no executor.
    """
    with Feed(board, OWNER) as feed:
        interface = feed.open("SkillerDebugInterface", skiller)
        # a Skiller without this interface may belong to an agent on the skill board; the agent's name is the
        # default of the Skiller's id
        if not interface.has_writer:
            return _find_board_skills(board, skiller)
        change: InterfaceChange | None = feed.read_state(interface)
        assert change is not None
        former_subject = change.values["graph_fsm"]
        deadline = Deadline(timeout_s)
        _request_graph(interface, "LIST")
        while change is not None and change.values["graph_fsm"] != "LIST":
            change = feed.wait_for_change(deadline)
        # viewers of the interface get their former graph back
        if former_subject != "LIST":
            _request_graph(interface, former_subject or "ACTIVE")
        return None if change is None else str(change.values["graph"]).split()


def _find_board_skills(board: BlackBoard, agent: str) -> list[str] | None:
    """Return the skills of an agent's executors on the skill board; None if the agent has no executor."""
    names: set[str] = set()
    for interface_info in board.list("SkillExecutorInterface"):
        with board.open_for_reading(interface_info.type, interface_info.id, owner=OWNER) as interface:
            interface.read()
            values = interface.as_dict()
            if interface_info.has_writer and values["agent"] == agent:
                names.update(values["skills"].split())
    return sorted(names) or None


def _request_graph(interface: Interface, subject: str) -> None:
    _send(interface, "SetGraphMessage", graph_fsm=subject)


def _send(interface: Interface, message_type: str, **fields: Any) -> int:
    """Send a message with these fields; return the id of the message."""
    message = interface.create_message(message_type)
    for name, value in fields.items():
        message.set(name, value)
    return interface.msgq_enqueue(message)
