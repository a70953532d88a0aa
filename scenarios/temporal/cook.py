"""The executor that stands for a cook."""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, Steps


class Cook(SkillExecutor):
    """Executes ``prepare`` and ``serve``: each takes the seconds that the setting of its name says."""

    skills = ("prepare", "serve")
    known_settings = skills

    def execute(self, call: SkillCall) -> Steps:
        """Work on the dish."""
        dish = call.text("dish")
        needed_us = self.setting(call.skill, 2.0) * MICROSECONDS
        begin_us = self.clock.now_us()
        while (passed_us := self.clock.now_us() - begin_us) < needed_us:
            yield Progress(passed_us / needed_us, f"{call.skill} {dish}")
