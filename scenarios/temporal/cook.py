"""An executor that simulates a cook."""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, Steps


class Cook(SkillExecutor):
    """Executes ``prepare{dish="egg"}`` and ``serve{dish="egg"}``.

    The settings ``prepare`` and ``serve`` are the durations of the skills in seconds, by default 2.
    """

    skills = ("prepare", "serve")
    known_settings = skills

    def execute(self, call: SkillCall) -> Steps:
        """Yield the progress of the work until its duration is over."""
        dish = call.text("dish")
        needed_us = self.setting(call.skill, 2.0) * MICROSECONDS
        begin_us = self.clock.now_us()
        while (passed_us := self.clock.now_us() - begin_us) < needed_us:
            yield Progress(passed_us / needed_us, f"{call.skill} {dish}")
