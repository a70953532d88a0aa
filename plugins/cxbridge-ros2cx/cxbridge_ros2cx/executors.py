"""The example executors of the thesis' executive, ros2-clips-executive (2021).

A dummy pretends to execute any skill; a simulated robot drives to waypoints. Sources: DummyMoveSkill.cpp,
MoveSkillNav2.cpp.
"""

from __future__ import annotations

import math
from typing import ClassVar

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board.executor import ExecutorContext, Progress, SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.protocol import SkillCall

# as in DummyMoveSkill.cpp
FEEDBACK_PERIOD_S = 0.5
_FEEDBACK_PERIOD_US = round(FEEDBACK_PERIOD_S * MICROSECONDS)
FEEDBACK_COUNT = 4  # feedback messages before the end


class DummyExecutor(SkillExecutor):
    """Sends feedback four times, half a second apart, and succeeds.

    Subclasses set ``skills``. The settings ``period``, in seconds, and ``feedbacks``, a count, change the
    defaults.
    """

    known_settings: ClassVar[tuple[str, ...]] = ("period", "feedbacks")
    period: ClassVar[float] = FEEDBACK_PERIOD_S

    def execute(self, call: SkillCall) -> Steps:
        self.log.info(f"Executing [{call.skill}] {' '.join(map(str, call.parameters.values()))}")
        period_us = round(self.setting("period", self.period) * MICROSECONDS)
        feedback_count = self.setting("feedbacks", FEEDBACK_COUNT)
        start_us = self.clock.now_us()
        for number in range(feedback_count):
            yield Progress(self.compute_progress(number, feedback_count), "running")
            while self.clock.now_us() < start_us + (number + 1) * period_us:
                yield None
        return Progress(1.0, "completed")

    def compute_progress(self, number: int, feedback_count: int) -> float:
        """Return the progress, from 0 to 1, in a feedback message; ``number`` counts the messages from 0."""
        return number / feedback_count


class ThesisDummyExecutor(DummyExecutor):
    """The dummy with a defect of the thesis' dummy: a factor of 0 in its progress."""

    def compute_progress(self, number: int, feedback_count: int) -> float:  # noqa: ARG002 - the defect
        return 0.0


class MoveExecutor(SkillExecutor):
    """Drives straight to the waypoint in its third parameter, as in ``move(ROBOT FROM TO)``.

    Subclasses may set other waypoints and speeds.
    """

    skills = ("move",)
    speed: ClassVar[float] = 0.22  # metres per second; the default is the speed of a TurtleBot3 Burger
    # coordinates in metres on the map of MoveSkillNav2.cpp, where wp4 and wp5 have the same coordinates
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

    def __init__(self, context: ExecutorContext) -> None:
        super().__init__(context)
        self.position = self.positions["wp_init"]

    def execute(self, call: SkillCall) -> Steps:
        """Report the progress and the remaining distance twice a second.

        :raises SkillFailedError: if the waypoint is unknown.
        """
        if (target_position := self.positions.get(call.text("3"))) is None:
            raise SkillFailedError(
                f"unknown waypoint {call.text('3')}, not one of {', '.join(self.positions)}"
            )
        start_position = self.position
        start_us = last_feedback_us = self.clock.now_us()
        distance_m = math.dist(start_position, target_position)
        yield Progress(0.0, "Move starting")
        while (driven_m := (self.clock.now_us() - start_us) / MICROSECONDS * self.speed) < distance_m:
            driven_share = driven_m / distance_m
            (start_x, start_y), (target_x, target_y) = start_position, target_position
            self.position = (
                start_x + driven_share * (target_x - start_x),
                start_y + driven_share * (target_y - start_y),
            )
            if self.clock.now_us() < last_feedback_us + _FEEDBACK_PERIOD_US:
                yield None
                continue
            last_feedback_us += _FEEDBACK_PERIOD_US
            remaining_m = distance_m - driven_m
            yield Progress(driven_share, f"Move running: {remaining_m:.2f} m remaining at {self.speed:g} m/s")
        self.position = target_position
        return Progress(1.0, "Move completed")
