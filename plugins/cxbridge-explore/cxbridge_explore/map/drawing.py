"""Draws the runs of an exploration: time to the right, each run below the one that it left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from cxbridge.trace.html.chart import Axis
from cxbridge.trace.html.text import html
from cxbridge_explore.map.rows import MapRow

_ROW, _BAR, _HEAD = 18, 8, 22
_CHART, _WIDTH = 560, 1100
_LETTERS: Final = 74
_TICKS: Final = 5

_GOOD, _FAILED, _BAD, _NONE = "good", "failed", "bad", "none"
_TONES: Final = {"completed": _GOOD, "unsuccessful": _FAILED, "merged": _NONE, "open": _NONE}

STYLE: Final = """
.runs { min-width: 60rem; width: 100%; height: auto; }
.runs text { font-size: 12px; fill: currentColor; }
.runs .good { fill: #2e7d32; } .runs .failed { fill: #c77700; } .runs .bad { fill: #c62828; }
.runs .none { fill: #8a8a8a; }
.runs path { stroke: #8a8a8a; fill: none; }
.runs .violated { font-weight: bold; }
"""


def draw(rows: Sequence[MapRow], numbers: Sequence[int]) -> str:
    """Return the drawing.

    :param rows: those to draw, each after the one that it left.
    :param numbers: their names as parents.
    """
    axis = Axis(max((row.end_s for row in rows), default=0.0) or 1.0, 4, _CHART)
    height = _HEAD + _ROW * len(rows) + 4
    places = {number: place for place, number in enumerate(numbers)}
    ticks = axis.ticks(axis.parts(_TICKS), _HEAD - 4, height)
    body = "".join((*ticks, *(_run(row, places, at, axis) for at, row in enumerate(rows))))
    label = f"{len(rows)} runs over time; the table below tells how they ended"
    size = f'viewBox="0 0 {_WIDTH} {height}"'
    return (
        '<div class="wide" tabindex="0" role="region" aria-label="Runs">'
        f'<svg class="runs" {size} role="img" aria-label="{html(label)}">{body}</svg></div>'
        '<p class="dim">A bar begins where its run did other than the one above, from which the line comes. '
        "Green: completed; orange: unsuccessful; red: stuck, or worse; grey: goes on as another run does.</p>"
    )


def _run(row: MapRow, places: dict[int, int], place: int, axis: Axis) -> str:
    top = _HEAD + _ROW * place
    middle = top + _ROW / 2
    left, right = (axis.at(at) for at in (row.begin_s, row.end_s))
    line = ""
    if row.parent is not None:
        above = _HEAD + _ROW * places[row.parent] + _ROW / 2
        line = f'<path d="M{left:.1f} {above:.1f} V{middle:.1f}"/>'
    tone = _TONES.get(row.outcome, _BAD)
    words = "; ".join(row.path) or "nothing but the usual"
    more = "".join(f"\n{each}" for each in row.violations)
    title = f"{words}\n{row.outcome}: {row.reason}{more}" if row.reason else f"{words}\n{row.outcome}{more}"
    mark = ' class="violated"' if row.violations else ""
    sign = "\N{MULTIPLICATION X} " if row.violations else ""
    text = f"{sign}{row.choice or 'the usual run'}"
    shown = text if len(text) <= _LETTERS else f"{text[: _LETTERS - 1]}\N{HORIZONTAL ELLIPSIS}"
    return (
        f"<g><title>{html(title)}</title>{line}"
        f'<rect class="{tone}" x="{left:.1f}" y="{middle - _BAR / 2:.1f}" '
        f'width="{max(right - left, 3):.1f}" height="{_BAR}" rx="2"/>'
        f'<text{mark} x="{_CHART + 20}" y="{middle + 4:.1f}">{html(shown)}</text></g>'
    )
