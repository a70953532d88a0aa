"""An executor's side of the skill board's protocol, which docs/skill-board.md describes.

An idle executor answers REQUEST with RESPONSE and is then reserved, until CONFIRM makes it busy, or REJECT,
CANCEL or a timeout makes it idle again. A busy executor executes one step of its skill per loop, sends
FEEDBACK, and ends with FINISH. An executor serves one master at a time, the master of its ticket.
"""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Generator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final
from uuid import UUID

from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.blackboard.listeners import EventKind, Listener, listening
from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError, SkillError
from cxbridge.skiller.board.executor import (
    Execution,
    ExecutorContext,
    Progress,
    SkillExecutor,
    SkillFailedError,
    Steps,
    error_text,
    execute_itself,
)
from cxbridge.skiller.board.protocol import (
    BOARD_TYPE,
    EXECUTOR_TYPE,
    MAX_SKILLS_BYTES,
    ExecutorState,
    SkillCall,
    SkillOutcome,
    Ticket,
    check_name,
    decode_parameters,
    limit_fraction,
    replace_surrogates,
)

if TYPE_CHECKING:
    from cxbridge.interfaces.instance import Interface

RESERVE_S: Final = 2.0
"""The maximum time from RESPONSE to CONFIRM in seconds.

Shorter than the default of :attr:`~cxbridge.skiller.board.master.Timeouts.start`: after a lost CONFIRM, the
executor is idle again before the master fails.
"""

_NO_TICKET: Final = Ticket("", 0, 0)
# The minimum time between two FEEDBACK messages with news, because a skill may yield news in each loop. Only
# the second FEEDBACK of a skill may come earlier.
_FEEDBACK_US: Final = 200_000
# The time between two FEEDBACK messages without news; well below the default of Timeouts.silence.
_SIGN_OF_LIFE_US: Final = 1_000_000


class ExecutorHost(Listener):
    """Serves the SkillExecutorInterface of an executor. Not thread-safe.

    :param executor: the executor, closed with the host.
    :param name: the id of the interface.
    :param verbatim: send each yielded value as FEEDBACK at once, and no signs of life.
    :raises SkillError: if names do not fit into messages.
    :raises BlackBoardError: if the interface has another writer.
    """

    def __init__(self, executor: SkillExecutor, name: str, *, verbatim: bool = False) -> None:
        self.name = check_name("an executor", name)
        self.executor = executor
        self.state = ExecutorState.IDLE
        self.ticket = _NO_TICKET
        """The ticket of the reservation or the running skill."""
        self.execution: Execution = execute_itself
        """Executes new calls."""
        check_name("an agent", executor.agent)
        self._skills = frozenset(executor.skills)
        self._board = executor.board
        self._clock = executor.clock
        self._log = executor.log
        self._call = SkillCall("", "")
        self._parameters = ""
        self._steps: Steps | None = None
        self._can_idle = True
        self._is_verbatim = verbatim
        self._has_reported = False  # whether the running skill has sent FEEDBACK
        self._progress = Progress(0.0)
        self._published_us = self._deadline_us = 0
        self._readers: dict[str, Interface] = {}
        self._lost_boards: deque[str] = deque()
        self._handlers = {
            "RequestMessage": self._handle_request,
            "ConfirmMessage": self._handle_confirm,
            "RejectMessage": self._handle_reject,
            "CancelMessage": self._handle_cancel,
        }
        skills = " ".join(check_skills(executor))
        executor.start()
        # the classes of the interfaces are made from XML at run time, so they have no static types
        try:
            interface: Any = self._board.open_for_writing(EXECUTOR_TYPE, name, owner=f"executor {name}")
        except BlackBoardError:
            executor.close()
            raise
        interface.agent, interface.skills = executor.agent, skills
        self._interface = interface
        self._publish()

    @property
    def valid(self) -> bool:
        """Whether the interface is still valid. Another program may write it after a reconnection."""
        return bool(self._interface.valid)

    def open_board(self, board: str) -> None:
        """Open a skill board's interface in advance.

        :raises BlackBoardError: if the interface cannot be opened.
        """
        # many hosts may send their first messages in the same loop, which must not take the time to open
        # interfaces, too
        self._open_reader(board)

    def listen(self, listener: Listener, event_kind: EventKind) -> None:
        """Register a listener for events of the interface."""
        self._board.register_listener(listener, self._interface, event_kind)

    def exchange(self) -> bool:
        """Handle and answer messages; return whether there were any."""
        while self._lost_boards:
            self._lose_board(self._lost_boards.popleft())
        interface, is_active = self._interface, False
        if not interface.msgq_empty() and interface.valid:
            while (message := interface.msgq_pop()) is not None:
                is_active = True
                self._handlers[message.type](message)
        if self.state is ExecutorState.RESERVED and self._clock.now_us() >= self._deadline_us:
            self._log.warn(f"{self.name}: no answer from {self.ticket.board} for {RESERVE_S:g} s")
            self._become_idle()
        return is_active

    def step(self) -> None:
        """Execute a step."""
        if self._steps is None:
            self._run_idle_step()
            return
        try:
            progress = next(self._steps)
        except StopIteration as end:
            self._progress = end.value if isinstance(end.value, Progress) else Progress(1.0)
            self._finish(SkillOutcome.SUCCEEDED)
        except CxbridgeError as error:
            if isinstance(error, SkillFailedError) and error.progress is not None:
                self._progress = Progress(error.progress)
            self._finish(SkillOutcome.FAILED, error.message)
        except Exception as error:  # noqa: BLE001 - a skill may fail in any way
            self._log.error(f"{self.name}: {self._call.skill} failed: {error_text(error)}")
            self._finish(SkillOutcome.FAILED, error_text(error))
        else:
            if progress is None or isinstance(progress, (int, float, Progress)):
                self._publish_feedback(progress)
                return
            self._end_steps()
            self._finish(SkillOutcome.FAILED, f"{self._call.skill} must yield its progress, not {progress!r}")

    def _run_idle_step(self) -> None:
        """Let the executor do a step without a skill, unless such a step has failed."""
        if self._can_idle:
            try:
                self.executor.idle()
            except Exception as error:  # noqa: BLE001 - an executor may fail in any way
                self._can_idle = False
                self._log.error(
                    f"{self.name}: idle() failed and will not be called again: {error_text(error)}"
                )

    def loop(self) -> None:
        """Do one loop."""
        self.exchange()
        self.step()

    def close(self) -> None:
        """End the skill, notify its master, and leave the blackboard."""
        if self._interface.valid and self.state is ExecutorState.BUSY:
            self._end_steps()
            self._finish(SkillOutcome.FAILED, f"the executor {self.name} was shut down")
        self.abandon()

    def abandon(self) -> None:
        """Leave the blackboard without messages, as a killed process does."""
        self._end_steps()
        self._interface.close()
        for reader in self._readers.values():
            reader.close()
        self._readers.clear()
        try:
            self.executor.close()
        except Exception as error:  # noqa: BLE001 - an executor may fail in any way
            self._log.error(f"{self.name}: close() failed: {error_text(error)}")

    def _handle_request(self, message: Any) -> None:
        if self.state is not ExecutorState.IDLE:
            return
        if message.agent != self.executor.agent or message.skill not in self._skills:
            self._log.warn(
                f"{self.name} of {self.executor.agent} was asked for {message.skill} of {message.agent}"
                f" by {message.board}, action {message.master}"
            )
            return
        self._call = SkillCall(message.skill, message.agent, {}, message.name)
        self._parameters = message.parameters
        self.ticket = Ticket(message.board, message.epoch, message.master)
        self.state = ExecutorState.RESERVED
        self._deadline_us = self._clock.now_us() + round(RESERVE_S * MICROSECONDS)
        if not self._send("ResponseMessage"):
            self.state, self.ticket = ExecutorState.IDLE, _NO_TICKET
        self._publish()  # also if idle again: a board that missed the answer may ask again

    def _handle_confirm(self, message: Any) -> None:
        ticket = Ticket(message.board, message.epoch, message.master)
        # the reservation has expired, or the executor has restarted: the master must ask again
        if ticket != self.ticket:
            self._send("FinishMessage", SkillOutcome.REFUSED.value, "", ticket=ticket)
        elif self.state is ExecutorState.RESERVED:
            self.state = ExecutorState.BUSY
            self._publish()
            self._start_execution()

    def _handle_reject(self, message: Any) -> None:
        if self.state is ExecutorState.RESERVED and self._is_for_present_ticket(message):
            self._become_idle()

    def _handle_cancel(self, message: Any) -> None:
        if not self._is_for_present_ticket(message):
            return
        if self.state is ExecutorState.BUSY:
            self._end_steps()
            self._finish(SkillOutcome.CANCELLED)
        elif self.state is ExecutorState.RESERVED:
            self._become_idle()

    def _is_for_present_ticket(self, message: Any) -> bool:
        return self.ticket == (message.board, message.epoch, message.master)

    def _lose_board(self, board: str) -> None:
        reader = self._readers.pop(board, None)
        if reader is not None:
            reader.close()
        if self.state is not ExecutorState.IDLE and self.ticket.board == board:
            self._log.warn(f"{self.name}: the skill board {board} is gone, so its requests are dropped")
            self._end_steps()
            self._become_idle()

    def _start_execution(self) -> None:
        self._progress, self._has_reported = Progress(0.0), False
        try:
            self._call = replace(self._call, parameters=decode_parameters(self._parameters))
            steps: object = self.execution(self.executor, self._call)
            if not isinstance(steps, Generator):
                # the handler below sends this error, too
                raise SkillError(f"execute() must be a generator, but has returned {steps!r}")  # noqa: TRY301
            self._steps = steps
        except Exception as error:  # noqa: BLE001 - a skill may fail in any way
            self._finish(SkillOutcome.FAILED, error_text(error))

    def _publish_feedback(self, progress: float | Progress | None) -> None:
        if progress is not None:
            self._progress = (
                progress if isinstance(progress, Progress) else Progress(progress, self._progress.text)
            )
        if self._is_verbatim:
            if progress is not None:
                self._send_feedback()
            return
        if not self._has_reported:
            self._has_reported = True
            self._send_feedback()
            # spread over time: skills that start together should not publish together
            self._published_us -= zlib.crc32(self.name.encode()) % _FEEDBACK_US
            return
        elapsed_us = self._clock.now_us() - self._published_us
        if elapsed_us >= _SIGN_OF_LIFE_US or (progress is not None and elapsed_us >= _FEEDBACK_US):
            self._send_feedback()

    def _send_feedback(self) -> None:
        self._published_us = self._clock.now_us()
        fraction, text = self._progress
        self._send("FeedbackMessage", limit_fraction(fraction), replace_surrogates(text))

    def _finish(self, outcome: SkillOutcome, error: str = "") -> None:
        fraction, text = self._progress
        self._send(
            "FinishMessage",
            outcome.value,
            replace_surrogates(error),
            limit_fraction(fraction),
            replace_surrogates(text),
        )
        self._become_idle()

    def _end_steps(self) -> None:
        """Close the generator of a running skill."""
        # first forget the generator, because the generator's cleaning up may call this executor
        steps, self._steps = self._steps, None
        if steps is not None:
            try:
                steps.close()
            except Exception as error:  # noqa: BLE001 - a skill may fail in any way
                self._log.error(f"{self.name}: cleaning up failed: {error_text(error)}")

    def _become_idle(self) -> None:
        self._steps = None
        self.state, self.ticket = ExecutorState.IDLE, _NO_TICKET
        self._publish()

    def _publish(self) -> None:
        interface = self._interface
        interface.state = self.state.value
        interface.board, interface.epoch, interface.master = self.ticket
        interface.skill = "" if self.state is ExecutorState.IDLE else self._call.skill
        if interface.valid:
            interface.write()

    def _send(self, message_type: str, *values: Any, ticket: Ticket | None = None) -> bool:
        """Send a message to a board; return whether it was delivered.

        :param values: the fields after the fields that all messages have.
        :param ticket: the ticket of the addressed master; None: the present ticket.
        """
        board, epoch, master = self.ticket if ticket is None else ticket
        try:
            reader = self._open_reader(board)
            reader.msgq_enqueue(reader.create_message(message_type, epoch, master, self.name, *values))
        except CxbridgeError as error:
            self._log.warn(f"{self.name}: {message_type} does not reach {board}: {error.message}")
            return False
        return True

    def _open_reader(self, board: str) -> Interface:
        reader = self._readers.get(board)
        if reader is not None and reader.valid:
            return reader
        reader = self._board.open_for_reading(
            BOARD_TYPE, board, owner=f"executor {self.name}", listen=listening(self, EventKind.WRITER_REMOVED)
        )
        self._readers[board] = reader
        return reader

    def writer_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002 - of Listener
        """Queue the end of a board. Called in any thread."""
        self._lost_boards.append(interface.id)


def make_host(
    executor_class: type[SkillExecutor], context: ExecutorContext, name: str, *, verbatim: bool = False
) -> ExecutorHost:
    """Make an executor and its host.

    :param verbatim: see :class:`ExecutorHost`.
    :raises SkillError: if the class fails, or names do not fit into messages.
    :raises CxbridgeError: if the class refuses its settings, or an interface has another writer.
    """
    try:
        return ExecutorHost(executor_class(context), name, verbatim=verbatim)
    except CxbridgeError:
        raise
    except Exception as error:
        raise SkillError(f"{executor_class.__name__} does not start: {error_text(error)}") from error


def check_skills(executor: SkillExecutor) -> tuple[str, ...]:
    """Return the skills of an executor, after a check of their names.

    :raises SkillError: if there are none, or if a name is invalid or the names do not fit into the interface.
    """
    class_name, skills = type(executor).__name__, executor.skills
    if isinstance(skills, str) or not skills:
        raise SkillError(f"{class_name} has no skills", hint="name the skills: skills = ('move',)")
    for skill in skills:
        check_name("a skill", skill)
        if len(skill.split()) != 1:
            raise SkillError(f"{class_name}: a skill's name must not contain blanks: {skill!r}")
    if len(" ".join(skills).encode()) > MAX_SKILLS_BYTES:
        raise SkillError(f"the names of the skills of {class_name} exceed {MAX_SKILLS_BYTES} bytes")
    return tuple(skills)
