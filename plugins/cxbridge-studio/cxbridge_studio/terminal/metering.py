"""Measures the rates of writes to interfaces, and draws plots of field values with characters."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import floor, isfinite, log10
from statistics import fmean, pstdev
from typing import Final

OWNER: Final = "cxbridge bb"  # the name under which the commands read interfaces

WINDOW: Final = 10_000  # latest writes over which a rate is computed, as in `ros2 topic hz`

_BLANK_CHARACTER: Final = 0x2800  # the first braille pattern, without dots; dots are the pixels of a plot
# the bits of the dots of a braille character: the left column, then the right column, from the top
_DOT_BITS: Final = ((0x01, 0x02, 0x04, 0x40), (0x08, 0x10, 0x20, 0x80))

_UNITS: Final = ("B", "kB", "MB", "GB")
_THOUSAND: Final = 1000.0
_MAX_WITHOUT_EXPONENT: Final = 1e6  # longer labels would narrow the plot


@dataclass(frozen=True, slots=True)
class Rate:
    """The rate of writes.

    :param hz: the mean rate.
    :param shortest_s: the shortest interval between two writes.
    :param longest_s: the longest interval.
    :param deviation_s: the standard deviation of the intervals.
    :param window: the number of measured writes.
    """

    hz: float
    shortest_s: float
    longest_s: float
    deviation_s: float
    window: int


class RateMeter:
    """Measures the rate of writes.

    :param window: the number of latest writes to consider.
    """

    def __init__(self, window: int = WINDOW) -> None:
        self._times: deque[float] = deque(maxlen=max(2, window))
        self._new_writes = 0

    def add(self, time_s: float) -> None:
        """Record a write."""
        self._times.append(time_s)
        self._new_writes += 1

    def new_writes(self) -> int:
        """Return the number of writes since the last call."""
        count, self._new_writes = self._new_writes, 0
        return count

    def rate(self) -> Rate | None:
        """Return the rate; None before the second write."""
        intervals = [later - earlier for earlier, later in pairwise(self._times)]
        if not intervals:
            return None
        mean = fmean(intervals)
        hz = 1 / mean if mean > 0 else float("inf")
        return Rate(hz, min(intervals), max(intervals), pstdev(intervals, mean), len(self._times))


def format_bytes(size: float) -> str:
    """Return a number of bytes with its unit."""
    unit = 0
    while size >= _THOUSAND and unit < len(_UNITS) - 1:
        size /= _THOUSAND
        unit += 1
    return f"{size:.2f} {_UNITS[unit]}" if unit else f"{size:.0f} {_UNITS[unit]}"


def draw_plot(points: Sequence[tuple[float, float]], width: int, height: int, span_s: float) -> Iterator[str]:
    """Yield the lines of a plot in braille characters with its axes.

    :param points: the time in seconds and the value of each point; the last point is at the right edge.
    :param span_s: the shown time span in seconds.
    """
    points = [(time_s, value) for time_s, value in points if isfinite(value)]
    low, high = _compute_axis_range([value for _, value in points])
    span = high - low
    labels = [_format_label(high - span * row / max(1, height - 1), span) for row in range(height)]
    margin = max(map(len, labels))
    plot_width = max(4, width - margin - 2)
    cells = [[0] * plot_width for _ in range(height)]
    end_s = points[-1][0] if points else 0.0
    previous_dot: tuple[int, int] | None = None
    for time_s, value in points:
        # a character has two columns and four rows of dots
        x = round((time_s - end_s + span_s) / span_s * (2 * plot_width - 1))
        y = round((high - value) / span * (4 * height - 1))
        if x < 0:  # the point is older than the shown time span
            continue
        for dot_x, dot_y in _find_step_dots(previous_dot, (x, y)):
            cells[dot_y // 4][dot_x // 2] |= _DOT_BITS[dot_x % 2][dot_y % 4]
        previous_dot = x, y
    for row, label in enumerate(labels):
        axis_label = label if row in {0, height // 2, height - 1} else ""
        characters = "".join(chr(_BLANK_CHARACTER + cell) for cell in cells[row]).rstrip(
            chr(_BLANK_CHARACTER)
        )
        yield f"{axis_label:>{margin}} ┤{characters}"
    begin, end = f"-{span_s:g} s", "now"
    yield f"{'':{margin}} └{'─' * plot_width}"
    yield f"{'':{margin}}  {begin}{end:>{max(1, plot_width - len(begin))}}"


def _find_step_dots(previous_dot: tuple[int, int] | None, dot: tuple[int, int]) -> Iterator[tuple[int, int]]:
    """Yield the dots of a step: horizontal, since a field keeps its value until a write, then vertical."""
    x, y = dot
    if previous_dot is not None:
        previous_x, previous_y = previous_dot
        yield from ((between, previous_y) for between in range(previous_x + 1, x))
        yield from ((x, between) for between in range(min(previous_y, y), max(previous_y, y) + 1))
    yield dot


def _compute_axis_range(values: Sequence[float]) -> tuple[float, float]:
    """Return the lowest and the highest value of the axis, with a margin around a constant value."""
    if not values:
        return 0.0, 1.0
    low, high = min(values), max(values)
    if low == high:  # an empty range cannot be scaled
        margin = abs(low) / 10 or 1.0
        return low - margin, high + margin
    return low, high


def _format_label(value: float, span: float) -> str:
    """Return the label of an axis value, with enough digits to differ from its neighbours."""
    digits = min(6, max(0, 2 - floor(log10(span))))
    return f"{value:.{digits}f}" if abs(value) < _MAX_WITHOUT_EXPONENT else f"{value:.3e}"
