"""A Skiller after use by earlier clients; the test chooses the time and result of each message."""

from __future__ import annotations

import threading
from typing import Any, Self

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from cxbridge.skiller.control import ExclusiveControl, ReaderWatch

OTHERS_SKILL = 'say{text="x"}'
"""The skill string of the earlier client."""

STATES = {
    "never used": (SkillerInterface.S_INACTIVE, "", ""),
    "stopped": (SkillerInterface.S_INACTIVE, "", ""),
    "idle": (SkillerInterface.S_INACTIVE, OTHERS_SKILL, ""),
    "final": (SkillerInterface.S_FINAL, OTHERS_SKILL, ""),
    "failed": (SkillerInterface.S_FAILED, OTHERS_SKILL, "no sound"),
    "running": (SkillerInterface.S_RUNNING, OTHERS_SKILL, ""),
}
"""Initial states: status, skill string and error. A running skill belongs to a client that has left."""


class UsedSkiller:
    """Behaves as Fawkes' Skiller (docs/evidence/skiller-facts.md), one skill per loop; a context manager.

    Each skill is final at once: RUNNING and FINAL are written in the same loop. A running skill of an earlier
    client ends in the loop of the next message, before that message.

    :param thief: serial of a client that steals control during each skill and executes a separate skill, with
        the message id of the stolen skill, as all senders count from the same number.
    """

    def __init__(self, state: str, last_id: int, *, controller: str = "", thief: str = "") -> None:
        self.board = LocalBlackBoard(InterfaceRegistry(), RealClock())
        log = EventBus(RealClock()).logger("Skiller")
        self._readers = ReaderWatch(self.board)
        self.interface: Any = self.board.open_for_writing(
            SkillerInterface, "Skiller", owner="skiller", listen=self._readers.listen
        )
        self._control = ExclusiveControl(self.interface, log)
        self.executed: list[str] = []
        """The skill strings of the messages of the test."""
        self.thief = thief
        self._set(*STATES[state], last_id)
        self.interface.exclusive_controller = controller
        self.interface.write()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self._stop.set()
        self._thread.join()
        self.board.shutdown()

    def _set(self, status: Any, skill: str, error: str, msgid: int) -> None:
        self.interface.status, self.interface.skill_string = status, skill
        self.interface.error, self.interface.msgid = error, msgid

    def _run(self) -> None:
        while not self._stop.wait(0.002):
            self._loop()

    def _loop(self) -> None:
        interface, to_write = self.interface, False
        while (serial := self._readers.pop_closed_serial()) is not None:
            to_write |= self._control.revoke(serial)
        text = None
        while (message := interface.msgq_pop()) is not None:
            if message.type == "AcquireControlMessage":
                to_write |= self._control.acquire(message)
            elif message.type == "ReleaseControlMessage":
                to_write |= self._control.release(message)
            elif message.type == "ExecSkillMessage" and self._control.may_execute(message):
                self._end_others()
                text = message.skill_string
                self.executed.append(text)
                self._set(interface.S_RUNNING, text, "", message.id)
                to_write = True
        if to_write:
            interface.write()
        if text is not None:
            if self.thief:
                interface.exclusive_controller, interface.skill_string = self.thief, OTHERS_SKILL
            interface.status = interface.S_FINAL
            interface.write()

    def _end_others(self) -> None:
        if self.interface.status == self.interface.S_RUNNING:
            self.interface.status = self.interface.S_FINAL
            self.interface.write()
