"""An executor that simulates a camera."""

from __future__ import annotations

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, Steps


class Camera(SkillExecutor):
    """Executes ``inspect{place="lab"}``; the setting ``seconds`` is the duration, by default 2."""

    skills = ("inspect",)
    known_settings = ("seconds",)

    def execute(self, call: SkillCall) -> Steps:
        """Yield the progress of the inspection until its duration is over."""
        place = call.text("place")
        needed_us = self.setting("seconds", 2.0) * MICROSECONDS
        begin_us = self.clock.now_us()
        while (passed_us := self.clock.now_us() - begin_us) < needed_us:
            yield Progress(passed_us / needed_us, f"looking at {place}")
