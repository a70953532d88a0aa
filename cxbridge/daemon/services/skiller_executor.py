"""An executor for the skill board that uses the Skiller of Fawkes or of a daemon.

A skill board distributes the skill calls of executives to executors. This executor lets such an
executive use the Skiller of a Fawkes, which needs no further plugin.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from cxbridge.blackboard.urls import open_blackboard
from cxbridge.errors import ConfigError, CxbridgeError, SkillError
from cxbridge.history.exchange import MAPPED_ACTION
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.skiller.board.executor import Progress, SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.protocol import SkillCall
from cxbridge.skiller.calls import CallOutcome, SkillerCall
from cxbridge.skiller.skillstring import parse_skill_string

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard


class SkillerExecutor(SkillExecutor):
    """Sends the mapped skill string of an action to a Skiller, under exclusive control.

    Only calls of skills with literal arguments are sent. Settings: ``url`` of the blackboard with the
    Skiller, and ``skiller``, its id.
    """

    known_settings: ClassVar[tuple[str, ...]] = ("url", "skiller")
    url: ClassVar[str] = "fawkes://localhost:1910"
    """The default of the setting ``url``."""

    def start(self) -> None:
        """Open the blackboard with the Skiller.

        :raises ConfigError: on a virtual clock, which would not wait for the Skiller, or if the setting
            ``url`` is not a text.
        :raises BlackBoardError: if the URL is invalid, or no server replies.
        """
        self._remote_board: BlackBoard | None = None
        if self.clock.is_virtual:
            raise ConfigError("a Skiller in another process needs the real clock", hint="add --clock real")
        self._remote_board = open_blackboard(self.setting("url", self.url), InterfaceRegistry(), self.clock)

    def execute(self, call: SkillCall) -> Steps:
        """Acquire control, send the skill string and wait until it ends.

        Cancelling the skill stops the skill string.

        :raises SkillFailedError: if the action has no skill string or an invalid one, control is
            refused, the connection is lost, or the skill string fails.
        """
        skill_string = str(call.get(MAPPED_ACTION, ""))
        if not skill_string:
            raise SkillFailedError(f"no skill is mapped to {call.skill}: see action-mapping")
        try:
            # the skill string may come from a client, and Fawkes evaluates any Lua code in skill strings
            parse_skill_string(skill_string)
        except SkillError as error:
            raise SkillFailedError(f"'{skill_string}' is not sent: {error.message}") from error
        assert self._remote_board is not None  # start() has opened it
        yield Progress(0.0, skill_string)
        try:
            with SkillerCall(self._remote_board, skiller=self.setting("skiller", "Skiller")) as skiller_call:
                result = yield from skiller_call.poll(skill_string)
        except CxbridgeError as error:
            raise SkillFailedError(error.message) from error
        if result.outcome is not CallOutcome.FINAL:
            raise SkillFailedError(result.error)
        yield Progress(1.0, "completed")

    def close(self) -> None:
        if self._remote_board is not None:
            self._remote_board.shutdown()
            self._remote_board = None


class TalkExecutor(SkillerExecutor):
    """Executes the say skills of an agent of fawkesrobotics/ros2-clips-executive (2021) with the Skiller."""

    skills = ("say-hello", "say-hello-again", "say-goodbye", "say-cleanup")
