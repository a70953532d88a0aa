"""An executor that simulates a driving robot."""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, Steps


class Driver(SkillExecutor):
    """Executes ``drive{to="office"}``; the setting ``seconds`` is the duration, by default 2."""

    skills = ("drive",)
    known_settings = ("seconds",)

    def execute(self, call: SkillCall) -> Steps:
        """Yield the progress of a drive until its duration is over."""
        needed_us = self.setting("seconds", 2.0) * MICROSECONDS
        begin_us = self.clock.now_us()
        while (passed_us := self.clock.now_us() - begin_us) < needed_us:
            yield Progress(passed_us / needed_us, f"to the {call.text('to')}")
