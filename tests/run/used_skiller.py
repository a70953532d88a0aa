"""A Skiller that others have used: what it does, message by message, and when, is the test's choice."""

from __future__ import annotations

import threading
from typing import Any, Self

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from cxbridge.skiller.control import ExclusiveControl, ReaderWatch

OTHERS_SKILL = 'say{text="x"}'
"""What the others had it execute."""

STATES = {
    "never used": (SkillerInterface.S_INACTIVE, "", ""),
    "stopped": (SkillerInterface.S_INACTIVE, "", ""),
    "idle": (SkillerInterface.S_INACTIVE, OTHERS_SKILL, ""),
    "final": (SkillerInterface.S_FINAL, OTHERS_SKILL, ""),
    "failed": (SkillerInterface.S_FAILED, OTHERS_SKILL, "no sound"),
    "running": (SkillerInterface.S_RUNNING, OTHERS_SKILL, ""),
}
"""How it may be left: status, skill string and error. Running: for somebody who is gone."""


class UsedSkiller:
    """Does what Fawkes' Skiller does (docs/evidence/skiller-facts.md), one skill a loop; a context manager.

    Each skill is final at once: RUNNING and FINAL are written in the same loop. A skill of others that runs
    ends in the very loop in which the next message is taken, before that.

    :param thief: serial of who steals control in mid-skill, each time, and has its own skill executed: with a
        message that has the id of the last one, as all senders count from the same number.
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
        """The skill strings that it was asked for in the test."""
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
        while (serial := self._readers.pop()) is not None:
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
