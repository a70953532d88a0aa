"""The executor that looks at a place."""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, Steps


class Camera(SkillExecutor):
    """Executes ``inspect{place="lab"}``: a picture takes its time, two seconds unless ``seconds`` says so."""

    skills = ("inspect",)
    known_settings = ("seconds",)

    def execute(self, call: SkillCall) -> Steps:
        """Take the picture."""
        place = call.text("place")
        needed_us = self.setting("seconds", 2.0) * MICROSECONDS
        begin_us = self.clock.now_us()
        while (passed_us := self.clock.now_us() - begin_us) < needed_us:
            yield Progress(passed_us / needed_us, f"looking at {place}")
