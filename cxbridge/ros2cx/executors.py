"""Executors that ship with the original: a dummy that pretends to do something.

Source: DummyMoveSkill.cpp.
"""

from __future__ import annotations

from typing import ClassVar

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board.executor import Progress, SkillExecutor, Steps
from cxbridge.skiller.board.protocol import SkillCall

PERIOD_S = 0.5
"""Seconds between feedback."""

FEEDBACKS = 4
"""How often feedback comes before the end."""


class DummyExecutor(SkillExecutor):
    """Sends feedback four times, half a second apart, and succeeds. Derive from it and name ``skills``."""

    known_settings: ClassVar[tuple[str, ...]] = ("period", "feedbacks")

    def execute(self, call: SkillCall) -> Steps:
        """Pretend to execute a skill."""
        self.log.info(f"Executing [{call.skill}] {' '.join(map(str, call.parameters.values()))}")
        period_us = round(self.setting("period", PERIOD_S) * MICROSECONDS)
        feedbacks = self.setting("feedbacks", FEEDBACKS)
        start_us = self.clock.now_us()
        for number in range(feedbacks):
            yield Progress(number / feedbacks, "running")
            while self.clock.now_us() < start_us + (number + 1) * period_us:
                yield None
