"""The write rates of interfaces, and plots of field values over time."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import floor, isfinite, log10, sqrt
from typing import Final

OWNER = "cxbridge bb"

WINDOW: Final = 10_000  # number of latest writes over which a rate is computed

_BLANK: Final = 0x2800  # the Unicode block of braille patterns, whose dots are the pixels of a plot
# The dots of a Braille character: left and right column from the top.
_DOTS: Final = ((0x01, 0x02, 0x04, 0x40), (0x08, 0x10, 0x20, 0x80))

_UNITS: Final = ("B", "kB", "MB", "GB")
_THOUSAND: Final = 1000.0
_LARGE: Final = 1e6  # larger numbers are shown with an exponent


@dataclass(frozen=True, slots=True)
class Rate:
    """The rate of writes.

    :param hz: the mean rate.
    :param shortest_s: the shortest interval; ``longest_s`` and ``deviation_s`` likewise.
    :param window: the number of intervals.
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
        self._news = 0

    def note(self, time_s: float) -> None:
        """Record a write."""
        self._times.append(time_s)
        self._news += 1

    def news(self) -> int:
        """Return the number of writes since the last call."""
        news, self._news = self._news, 0
        return news

    def rate(self) -> Rate | None:
        """Return the rate; None before the second write."""
        times = list(self._times)
        gaps = [later - earlier for earlier, later in pairwise(times)]
        if not gaps:
            return None
        mean = sum(gaps) / len(gaps)
        deviation = sqrt(sum((gap - mean) ** 2 for gap in gaps) / len(gaps))
        hz = 1 / mean if mean > 0 else float("inf")
        return Rate(hz, min(gaps), max(gaps), deviation, len(times))


def amount(size: float) -> str:
    """Return a number of bytes with its unit."""
    unit = 0
    while size >= _THOUSAND and unit < len(_UNITS) - 1:
        size /= _THOUSAND
        unit += 1
    return f"{size:.2f} {_UNITS[unit]}" if unit else f"{size:.0f} {_UNITS[unit]}"


def drawing(points: Sequence[tuple[float, float]], width: int, height: int, span_s: float) -> Iterator[str]:
    """Yield the lines of a plot in Braille characters with its axes.

    :param points: seconds and values; the last one is at the right edge.
    :param span_s: the shown time span in seconds.
    """
    points = [(time_s, value) for time_s, value in points if isfinite(value)]
    low, high = _bounds([value for _, value in points])
    span = high - low
    labels = [_label(high - span * row / max(1, height - 1), span) for row in range(height)]
    margin = max(map(len, labels))
    inner = max(4, width - margin - 2)
    cells = [[0] * inner for _ in range(height)]
    end_s = points[-1][0] if points else 0.0
    previous_point: tuple[int, int] | None = None
    for time_s, value in points:
        x = round((time_s - end_s + span_s) / span_s * (2 * inner - 1))
        y = round((high - value) / (high - low) * (4 * height - 1))
        if x < 0:
            continue
        for dot in _way(previous_point, (x, y)):
            cells[dot[1] // 4][dot[0] // 2] |= _DOTS[dot[0] % 2][dot[1] % 4]
        previous_point = x, y
    for row, label in enumerate(labels):
        shown = label if row in {0, height // 2, height - 1} else ""
        yield f"{shown:>{margin}} ┤" + "".join(chr(_BLANK + cell) for cell in cells[row]).rstrip(chr(_BLANK))
    begin, end = f"-{span_s:g} s", "now"
    yield f"{'':{margin}} └{'─' * inner}"
    yield f"{'':{margin}}  {begin}{end:>{max(1, inner - len(begin))}}"


def _way(previous_point: tuple[int, int] | None, here: tuple[int, int]) -> Iterator[tuple[int, int]]:
    """Yield the dots of a step: first horizontal at the old value, then vertical to the new one."""
    x, y = here
    if previous_point is not None:
        for along in range(previous_point[0] + 1, x):
            yield along, previous_point[1]
        first, last = sorted((previous_point[1], y))
        for between in range(first, last + 1):
            yield x, between
    yield here


def _bounds(values: Sequence[float]) -> tuple[float, float]:
    """Return the range of the axis."""
    if not values:
        return 0.0, 1.0
    low, high = min(values), max(values)
    if low == high:
        more = abs(low) / 10 or 1.0
        return low - more, high + more
    return low, high


def _label(value: float, span: float) -> str:
    """Return the label of an axis value, with enough digits to differ from its neighbours."""
    digits = min(6, max(0, 2 - floor(log10(span))))
    return f"{value:.{digits}f}" if abs(value) < _LARGE else f"{value:.3e}"
