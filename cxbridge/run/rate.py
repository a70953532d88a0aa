"""The main loop of a run, and its configured duration."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cxbridge.errors import ConfigError
from cxbridge.mainloop import DEFAULT_PERIOD_US, MainLoop
from cxbridge.process.loop_times import LoopTimes

if TYPE_CHECKING:
    from cxbridge.config import Configuration
    from cxbridge.events import EventBus


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


def make_main_loop(period_us: int, bus: EventBus) -> MainLoop:
    """Make the main loop; on a clock that is not virtual the loop reports its durations.

    :param period_us: the desired duration of a loop, in microseconds.
    """
    loop = MainLoop(bus.clock, period_us)
    if not bus.clock.is_virtual:
        LoopTimes(loop, bus)
    return loop
