"""A Skiller that replays a recording."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from cxbridge.blackboard import BlackBoard
from cxbridge.events import EventBus
from cxbridge.interfaces.instance import Message
from cxbridge.run.replay.divergence import Divergence, Expectation
from cxbridge.run.replay.script import Command, CommandKind, SkillerScript, Values
from cxbridge.skiller.backend import SkillerBackend
from cxbridge.skiller.control import ExclusiveControl, ReaderWatch

COMPONENT = "Replay"


class RecordedSkiller(SkillerBackend):
    """Serves a SkillerInterface from a recording.

    :param start_us: the start of the recorded run, where the clock of this run starts, too.
    :param is_complete: whether the recording reaches the end of its run.
    :param report: receives each divergence, an overdue command at each check.
    :raises BlackBoardError: if the interface has another writer.
    """

    def __init__(
        self,
        board: BlackBoard,
        bus: EventBus,
        name: str,
        script: SkillerScript,
        *,
        start_us: int,
        is_complete: bool,
        report: Callable[[Divergence], None],
    ) -> None:
        super().__init__(name)
        self._board = board
        self._clock = board.clock
        self._log = bus.logger(COMPONENT)
        self._readers = ReaderWatch(board)
        # the class of the interface is made from XML at run time, so it has no static type
        self._interface: Any = board.open_for_writing(
            "SkillerInterface", name, owner=COMPONENT, listen=self._readers.listen
        )
        self._control = ExclusiveControl(self._interface, self._log)
        # the times of the recorded run in microseconds since the epoch, with the values to write
        self._initial_writes: deque[tuple[int, Values]] = deque(script.initial_writes)
        self._control_commands = deque(
            command for command in script.commands if command.kind is CommandKind.CONTROL
        )
        commands = [command for command in script.commands if command.kind is not CommandKind.CONTROL]
        self.expectation = Expectation(
            f"SkillerInterface::{name}", commands, start_us, is_complete=is_complete, report=report
        )
        self._current: Command | None = None
        # the times of this run in microseconds since the epoch, with the values to write
        self._pending_writes: deque[tuple[int, Values]] = deque()

    @property
    def running(self) -> bool:
        """Whether recorded writes are pending."""
        return bool(self._pending_writes or self._initial_writes)

    def loop(self) -> None:
        """Handle messages and make the writes that are due."""
        while (serial := self._readers.pop_closed_serial()) is not None:
            if self._control.revoke(serial):
                self._interface.write()
        now_us = self._clock.now_us()
        while self._initial_writes and self._initial_writes[0][0] <= now_us:
            self._write(self._initial_writes.popleft()[1])
        self._take_messages(now_us)
        while self._pending_writes and self._pending_writes[0][0] <= now_us:
            self._write(self._pending_writes.popleft()[1])
        self.expectation.check(now_us)

    def close(self) -> None:
        self._readers.close()
        self._board.close(self._interface)

    def _take_messages(self, now_us: int) -> None:
        last_message: Any = None
        while (message := self._interface.msgq_pop()) is not None:
            if message.type == "AcquireControlMessage":
                self._handle_acquisition(message)
            elif message.type == "ReleaseControlMessage":
                if self._control.release(message):
                    self._interface.write()
            elif message.type != "ExecSkillMessage" or self._control.admit(
                message,
                is_second=last_message is not None and last_message.type == "ExecSkillMessage",
                is_running=bool(self._pending_writes),
            ):
                last_message = message  # the Skiller obeys the last command of a loop
        if last_message is not None:
            self._handle_command(last_message, now_us)

    def _handle_acquisition(self, message: Message) -> None:
        if not self._control.acquire(message):
            return
        recorded_command = self._control_commands.popleft() if self._control_commands else None
        if recorded_command is not None and not self._interface.skill_string:
            # Fawkes' simulator writes the id of the message here, Fawkes' Skiller writes 0
            self._interface.msgid = message.id if recorded_command.values["msgid"] else 0
        self._interface.write()

    def _handle_command(self, message: Any, now_us: int) -> None:
        kind = CommandKind.EXEC if message.type == "ExecSkillMessage" else CommandKind.STOP
        skill_string = message.skill_string if kind is CommandKind.EXEC else ""
        if kind is CommandKind.STOP and not self._interface.skill_string:
            return  # no skill to stop: the recorded Skiller did not write either
        expected = self.expectation.expected
        if expected is None or not expected.is_for(kind, skill_string):
            self.expectation.refuse(f"{kind.value} '{skill_string}'" if skill_string else kind.value, now_us)
            return
        if self._pending_writes:
            self._log.warn(f"{self.name}: {expected} came before the writes that precede it in the recording")
        self.expectation.meet(now_us)
        self._current = expected
        self._initial_writes.clear()
        self._interface.skill_string = skill_string
        self._interface.msgid = message.id if kind is CommandKind.EXEC else 0
        self._pending_writes = deque(
            (now_us + after_us, values) for after_us, values in expected.later_writes
        )
        self._write(expected.values)

    def _write(self, values: Values) -> None:
        """Repeat a recorded write, but with the skill string, message id and controller of this run."""
        current = self._current
        for name, value in values.items():
            is_of_this_run = name == "exclusive_controller" or (
                current is not None and name in ("skill_string", "msgid") and value == current.values[name]
            )
            if not is_of_this_run:
                self._interface.set(name, value)
        self._interface.mark_data_refreshed()
        self._interface.write()
