"""The axis of time of drawings in pages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

_LETTERS_AT = 12
"""Pixels from the top to the line of the numbers."""

_ROUND_FROM = 1000
"""Seconds that are shown without a fraction."""

STYLE = """
.tick { stroke: #8a8a8a; stroke-opacity: 0.3; }
"""


@dataclass(frozen=True, slots=True)
class Axis:
    """Seconds to the right.

    :param seconds: at its right end; more than 0.
    :param left: pixels to its left end.
    :param width: pixels.
    """

    seconds: float
    left: float
    width: float

    def at(self, seconds: float) -> float:
        """Return the pixels to a time."""
        return self.left + self.width * seconds / self.seconds

    def ticks(self, times: Iterable[float], top: float, bottom: float) -> Iterator[str]:
        """Yield a line with its number for each of some times."""
        for time in times:
            at = self.at(time)
            yield f'<line class="tick" x1="{at:.1f}" x2="{at:.1f}" y1="{top}" y2="{bottom}"/>'
            anchor = "end" if time >= self.seconds else "start"
            number = f"{time:.3g}" if abs(time) < _ROUND_FROM else f"{time:.0f}"
            yield f'<text x="{at:.1f}" y="{_LETTERS_AT}" text-anchor="{anchor}">{number} s</text>'

    def parts(self, count: int) -> list[float]:
        """Return the times that part it into equal parts, with both ends."""
        return [self.seconds * part / count for part in range(count + 1)]
