"""When an executive thinks: in each loop, or at a rate of its own, as the executive for ROS 2 does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge.ros2cx.parameters import refresh_period_us
from cxbridge.ros2cx.refresh import RefreshTimer
from cxbridge.run.parts import loop_period_us

if TYPE_CHECKING:
    from cxbridge.clock import Clock
    from cxbridge.config import Configuration
    from cxbridge.executive.executive import Executive
    from cxbridge.run.paths import Places


def main_period_us(config: Configuration, *, ros2cx: bool) -> int:
    """Return the desired time of a loop: short enough for the executive's own rate.

    :raises ConfigError: when a rate or time makes no sense.
    """
    period_us = loop_period_us(config)
    return min(period_us, refresh_period_us(config)) if ros2cx else period_us


def make_refresh(config: Configuration, clock: Clock, places: Places) -> RefreshTimer | None:
    """Return the timer of an executive with a rate of its own; None: it thinks in each loop."""
    return None if places.ros2cx is None else RefreshTimer(clock, refresh_period_us(config))


def think(executive: Executive, refresh: RefreshTimer | None) -> int:
    """Let an executive think if it is time to; return how many rules fired.

    While its rules are stopped in the middle of a run, they go on as soon as they may.
    """
    if refresh is None or executive.debugger.within_loop:
        return executive.loop()
    fired = 0
    while refresh.due():
        fired += executive.loop()
    return fired
