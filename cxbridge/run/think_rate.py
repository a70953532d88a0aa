"""When an executive thinks: in each loop, or at a rate of its own, as the executive for ROS 2 does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cxbridge.errors import ConfigError
from cxbridge.mainloop import DEFAULT_PERIOD_US, MainLoop
from cxbridge.process.loop_times import LoopTimes
from cxbridge.ros2cx.parameters import refresh_period_us
from cxbridge.ros2cx.refresh import RefreshTimer

if TYPE_CHECKING:
    from cxbridge.clock import Clock
    from cxbridge.config import Configuration
    from cxbridge.events import EventBus
    from cxbridge.executive.executive import Executive
    from cxbridge.run.paths import RunPaths


_PERIOD: Final = "/fawkes/mainapp/desired_loop_time"
_SHORTEST_PERIOD_US: Final = 100


def loop_period_us(config: Configuration) -> int:
    """Return the desired time of a loop.

    :raises ConfigError: when it is so short that a virtual clock would hardly move, or not at all.
    """
    period_us = config.get_uint(_PERIOD, default=DEFAULT_PERIOD_US)
    if period_us >= _SHORTEST_PERIOD_US:
        return period_us
    place = config.get(_PERIOD)
    raise ConfigError(
        f"{_PERIOD} cannot be {period_us}",
        file=place.file,
        line=place.line,
        hint=f"microseconds, {_SHORTEST_PERIOD_US} at least; Fawkes has {DEFAULT_PERIOD_US}",
    )


def main_period_us(config: Configuration, *, ros2cx: bool) -> int:
    """Return the desired time of a loop: short enough for the executive's own rate.

    :raises ConfigError: when a rate or time makes no sense.
    """
    period_us = loop_period_us(config)
    return min(period_us, refresh_period_us(config)) if ros2cx else period_us


def make_main_loop(config: Configuration, bus: EventBus, *, ros2cx: bool) -> MainLoop:
    """Make the main loop; on a clock that is not virtual it reports how long each loop took.

    :raises ConfigError: when a rate or time makes no sense.
    """
    loop = MainLoop(bus.clock, main_period_us(config, ros2cx=ros2cx))
    if not bus.clock.is_virtual:
        LoopTimes(loop, bus)
    return loop


def make_refresh(config: Configuration, clock: Clock, paths: RunPaths) -> RefreshTimer | None:
    """Return the timer of an executive with a rate of its own; None: it thinks in each loop."""
    return None if paths.ros2cx is None else RefreshTimer(clock, refresh_period_us(config))


def think(executive: Executive, refresh: RefreshTimer | None) -> int:
    """Let an executive think if it is time to; return how many rules fired.

    While its rules are stopped in the middle of a run, they go on as soon as they may.
    """
    if refresh is None or executive.within_loop:
        return executive.loop()
    fired = 0
    while refresh.due():
        fired += executive.loop()
    return fired
