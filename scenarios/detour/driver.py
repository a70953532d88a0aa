"""The executor that stands for a robot that drives."""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, Steps


class Driver(SkillExecutor):
    """Executes ``drive``, which takes the seconds of the setting ``seconds``."""

    skills = ("drive",)
    known_settings = ("seconds",)

    def execute(self, call: SkillCall) -> Steps:
        """Drive to the room."""
        needed_us = self.setting("seconds", 2.0) * MICROSECONDS
        begin_us = self.clock.now_us()
        while (passed_us := self.clock.now_us() - begin_us) < needed_us:
            yield Progress(passed_us / needed_us, f"to the {call.text('to')}")
