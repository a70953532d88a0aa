"""An executor for the skill board that has a Skiller execute its skills, of a Fawkes or a daemon.

With it the executive of the thesis drives a Fawkes' Skiller: the plugin for Fawkes that the thesis has for it
(chapter 5.2) is not needed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Final

from cxbridge.app.boards import open_board
from cxbridge.blackboard.stale_ids import skip_stale_ids
from cxbridge.clock import MICROSECONDS
from cxbridge.errors import BlackBoardError, ConfigError
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.skiller.board.executor import Progress, SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.protocol import SkillCall

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.interfaces.instance import Interface

CONTROL_S: Final = 5.0
"""Seconds in which the Skiller must give control."""

_OWNER: Final = "executor skiller"


class SkillerExecutor(SkillExecutor):
    """Sends the mapped skill string of an action to a Skiller.

    Settings: ``url`` of the blackboard with the Skiller, and ``skiller``, its id.

    :raises ConfigError: on a virtual clock, which would not wait for a Skiller elsewhere.
    """

    known_settings: ClassVar[tuple[str, ...]] = ("url", "skiller")
    url: ClassVar[str] = "fawkes://localhost:1910"
    """Where the Skiller is, unless the setting says otherwise."""

    def start(self) -> None:
        """Open the Skiller's interface."""
        self._far: BlackBoard | None = None
        if self.clock.is_virtual:
            raise ConfigError("a Skiller elsewhere needs the real clock", hint="add --clock real")
        self._far = open_board(self.setting("url", self.url), InterfaceRegistry(), self.clock)
        self._opened: Interface = self._far.open_for_reading(
            "SkillerInterface", self.setting("skiller", "Skiller"), owner=_OWNER
        )

    def execute(self, call: SkillCall) -> Steps:
        """Take control, send the skill string, wait for the end; stop it when the skill is cancelled."""
        skill_string = str(call.get("mapped_action", ""))
        if not skill_string:
            raise SkillFailedError(f"no skill is mapped to {call.skill}: see action-mapping")
        yield from self._acquire()
        skip_stale_ids(self._opened, controls=True)
        msgid = self._send("ExecSkillMessage", skill_string=skill_string)
        over, begun = False, False
        try:
            while True:
                shown = self._read()
                if shown.exclusive_controller != str(self._opened.serial):
                    over = True
                    raise SkillFailedError("control of the Skiller was lost")
                status = getattr(shown.status, "name", str(shown.status))
                if shown.msgid == msgid and status in ("S_FINAL", "S_FAILED"):
                    over = True
                    if status == "S_FAILED":
                        raise SkillFailedError(shown.error or "the Skiller gives no reason")
                    return Progress(1.0, "completed")
                if shown.msgid == msgid and not begun:
                    begun = True
                    yield Progress(0.0, skill_string)
                else:
                    yield None
        finally:
            if not over:
                self._send("StopExecMessage")

    def _acquire(self) -> Steps:
        until_us = self.clock.now_us() + round(CONTROL_S * MICROSECONDS)
        shown, us = self._read(), str(self._opened.serial)
        if shown.exclusive_controller == us:
            return None
        if shown.exclusive_controller:
            raise SkillFailedError(f"somebody else has control of the Skiller ({shown.exclusive_controller})")
        self._send("AcquireControlMessage")
        while self._read().exclusive_controller != us:
            if self.clock.now_us() > until_us:
                raise SkillFailedError(f"the Skiller did not give control within {CONTROL_S:g} s")
            yield None
        return None

    def _read(self) -> Any:
        """Return what the Skiller shows.

        :raises SkillFailedError: when there is none any more.
        """
        try:
            self._opened.read()
        except BlackBoardError as error:
            raise SkillFailedError(f"the Skiller is gone: {error}") from error
        if not self._opened.has_writer:
            raise SkillFailedError("no Skiller is there")
        return self._opened

    def _send(self, message_type: str, **fields: Any) -> int:
        message = self._opened.create_message(message_type)
        for name, value in fields.items():
            message.set(name, value)
        return self._opened.msgq_enqueue(message)

    def close(self) -> None:
        """Give control back and leave the blackboard."""
        if self._far is None:
            return
        if self._opened.valid and self._opened.has_writer:
            self._send("ReleaseControlMessage")
        self._far.shutdown()
        self._far = None


class TalkExecutor(SkillerExecutor):
    """Has the Skiller say what the actions of the thesis' talking agents say."""

    skills = ("say-hello", "say-hello-again", "say-goodbye", "say-cleanup")
