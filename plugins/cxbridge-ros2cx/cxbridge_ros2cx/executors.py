"""Executors that ship with the original: a dummy that pretends to do something, and one that drives.

Sources: DummyMoveSkill.cpp, MoveSkillNav2.cpp.
"""

from __future__ import annotations

import math
from typing import ClassVar

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board.executor import ExecutorContext, Progress, SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.protocol import SkillCall

PERIOD_S = 0.5
"""Seconds between feedback."""

_PERIOD_US = round(PERIOD_S * MICROSECONDS)

FEEDBACKS = 4
"""How often feedback comes before the end."""


class DummyExecutor(SkillExecutor):
    """Sends feedback four times, half a second apart, and succeeds. Derive from it and name ``skills``."""

    known_settings: ClassVar[tuple[str, ...]] = ("period", "feedbacks")
    period: ClassVar[float] = PERIOD_S
    """Seconds between feedback, unless the setting says otherwise."""

    def execute(self, call: SkillCall) -> Steps:
        """Pretend to execute a skill."""
        self.log.info(f"Executing [{call.skill}] {' '.join(map(str, call.parameters.values()))}")
        period_us = round(self.setting("period", self.period) * MICROSECONDS)
        feedbacks = self.setting("feedbacks", FEEDBACKS)
        start_us = self.clock.now_us()
        for number in range(feedbacks):
            yield Progress(self.progress(number, feedbacks), "running")
            while self.clock.now_us() < start_us + (number + 1) * period_us:
                yield None
        return Progress(1.0, "completed")

    def progress(self, number: int, feedbacks: int) -> float:
        """Return how far it is at the feedback with this number, from 0."""
        return number / feedbacks


class OriginalDummy(DummyExecutor):
    """As the original's, which multiplies its progress by 0."""

    def progress(self, number: int, feedbacks: int) -> float:  # noqa: ARG002
        """Return 0."""
        return 0.0


class MoveExecutor(SkillExecutor):
    """Drives straight to the waypoint in its third parameter, as ``move(ROBOT FROM TO)`` names it.

    Derive from it for other places and speeds.
    """

    skills = ("move",)
    speed: ClassVar[float] = 0.22
    """Metres per second, a TurtleBot3 Burger's."""
    positions: ClassVar[dict[str, tuple[float, float]]] = {
        "wp_init": (-2.0, -0.4),
        "wp1": (1.76, 0.68),
        "wp2": (-1.58, 1.41),
        "wp3": (1.07, -1.72),
        "wp4": (0.63, 1.74),
        "wp5": (0.63, 1.74),
        "wp6": (-2.57, 0.02),
        "wp_final": (-2.0, -0.4),
    }
    """Where the waypoints are, in metres on the map."""

    def __init__(self, context: ExecutorContext) -> None:
        super().__init__(context)
        self.position = self.positions["wp_init"]

    def execute(self, call: SkillCall) -> Steps:
        """Report twice a second how far it is, and how far it has to go."""
        if (to := self.positions.get(call.text("3"))) is None:
            raise SkillFailedError(
                f"there is no waypoint {call.text('3')}: there are {', '.join(self.positions)}"
            )
        start, start_us, feedback_us = self.position, self.clock.now_us(), self.clock.now_us()
        distance = math.dist(start, to)
        yield Progress(0.0, "Move starting")
        while (driven := (self.clock.now_us() - start_us) / MICROSECONDS * self.speed) < distance:
            share = driven / distance
            self.position = (start[0] + share * (to[0] - start[0]), start[1] + share * (to[1] - start[1]))
            if self.clock.now_us() < feedback_us + _PERIOD_US:
                yield None
                continue
            feedback_us += _PERIOD_US
            left = distance - driven
            yield Progress(share, f"Move running: {left:.2f} m remaining at {self.speed:g} m/s")
        self.position = to
        return Progress(1.0, "Move completed")
