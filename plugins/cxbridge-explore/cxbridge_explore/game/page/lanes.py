"""Draws lanes over time: what each one did, as bars with words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from cxbridge.history.outcome import OutcomeKind
from cxbridge.trace.html.chart import Axis
from cxbridge.trace.html.parts import Look
from cxbridge.trace.html.text import html

_ROW, _BAR, _HEAD = 22, 16, 22
_LABELS, _NARROWEST, _WIDEST = 150, 900, 12_000
_PIXELS_A_SECOND: Final = 6.0
_LETTER: Final = 6.6
"""Pixels."""

_TICK_S: Final = (10, 30, 60, 120, 300, 600)
_TICK_PIXELS: Final = 100

STYLE: Final = """
.lanes { display: flex; }
.lanes > svg { flex: none; }
.lanes > .wide { flex: 1; min-width: 0; }
.lanes text { font-size: 11px; fill: currentColor; }
.lanes .group { font-weight: bold; }
.lanes rect, .lanes circle { fill: var(--tone); stroke: rgb(128 128 128 / 60%); }
.lanes rect.t-failed { stroke: #c62828; stroke-width: 2; }
.lanes .word { fill: var(--ink); pointer-events: none; }
.lanes .row { stroke: var(--line); }
"""


@dataclass(frozen=True, slots=True)
class Bar:
    """A time in a lane, in seconds.

    :param text: is written into the bar, as far as there is room; empty for none.
    :param title: the text for a bar under the pointer.
    :param mark: is written when there is no room for the text.
    """

    begin: float
    end: float
    look: Look | OutcomeKind
    text: str
    title: str
    mark: str = ""


@dataclass(frozen=True, slots=True)
class LanePoint:
    """A moment in a lane; its icon is written there."""

    at: float
    look: Look | OutcomeKind
    title: str


@dataclass(frozen=True, slots=True)
class Lane:
    """A line of the drawing.

    :param bars: in order.
    """

    label: str
    bars: Sequence[Bar] = ()
    points: Sequence[LanePoint] = ()


@dataclass(frozen=True, slots=True)
class LaneGroup:
    """Lanes below a heading."""

    label: str
    lanes: Sequence[Lane]


def draw(groups: Sequence[LaneGroup], seconds: float, label: str) -> str:
    """Return the drawing.

    :param seconds: how long it is; bars end there.
    :param label: a description for screen readers.
    """
    seconds = seconds if seconds > 0 else 1.0
    width = min(max(_NARROWEST, seconds * _PIXELS_A_SECOND), _WIDEST)
    axis = Axis(seconds, 4, width - 8)
    rows: list[LaneGroup | Lane] = []
    for group in groups:
        rows += [group, *group.lanes] if group.lanes else []
    height = _HEAD + _ROW * len(rows) + 4
    labels = "".join(_label(row, place) for place, row in enumerate(rows))
    body = "".join(
        (
            *axis.ticks(_ticks(axis), _HEAD - 4, height),
            *(part for place, row in enumerate(rows) for part in _row(row, place, axis)),
        )
    )
    return (
        f'<div class="lanes"><svg width="{_LABELS}" height="{height}" aria-hidden="true">{labels}</svg>'
        f'<div class="wide" tabindex="0" role="region" aria-label="{html(label)}">'
        f'<svg width="{width:.0f}" height="{height}" role="img" aria-label="{html(label)}">{body}</svg>'
        "</div></div>"
    )


def _ticks(axis: Axis) -> list[float]:
    room = axis.seconds * _TICK_PIXELS / axis.width
    step = next((each for each in _TICK_S if each >= room), math.ceil(room))
    return [float(time) for time in range(0, math.floor(axis.seconds) + 1, step)]


def _label(row: LaneGroup | Lane, place: int) -> str:
    cls = ' class="group"' if isinstance(row, LaneGroup) else ""
    text = html(_cut(row.label, _LABELS))
    return f'<text{cls} x="2" y="{_middle(place) + 4:.0f}"><title>{html(row.label)}</title>{text}</text>'


def _row(row: LaneGroup | Lane, place: int, axis: Axis) -> Iterator[str]:
    middle = _middle(place)
    bottom = middle + _ROW / 2
    right = axis.left + axis.width
    yield f'<line class="row" x1="{axis.left}" x2="{right:.1f}" y1="{bottom:.0f}" y2="{bottom:.0f}"/>'
    if isinstance(row, Lane):
        yield from (_bar(bar, middle, axis) for bar in row.bars if bar.begin < axis.seconds)
        yield from (_point(point, middle, axis) for point in row.points)


def _bar(bar: Bar, middle: float, axis: Axis) -> str:
    left, right = axis.at(max(bar.begin, 0.0)), axis.at(min(bar.end, axis.seconds))
    width = max(right - left, 1.0)
    text = _cut(bar.text, width - 4) or bar.mark
    word = f'<text class="word" x="{left + 3:.1f}" y="{middle + 4:.0f}">{html(text)}</text>' if text else ""
    return (
        f'<g class="t-{bar.look.tone}"><title>{html(bar.title)}</title><rect class="t-{bar.look.tone}" '
        f'x="{left:.1f}" y="{middle - _BAR / 2:.0f}" width="{width:.1f}" height="{_BAR}" rx="2"/>{word}</g>'
    )


def _point(point: LanePoint, middle: float, axis: Axis) -> str:
    at = axis.at(min(max(point.at, 0.0), axis.seconds))
    return (
        f'<g><title>{html(point.title)}</title><circle class="point t-{point.look.tone}" cx="{at:.1f}" '
        f'cy="{middle:.0f}" r="8"/><text class="word" x="{at:.1f}" y="{middle + 4:.0f}" '
        f'text-anchor="middle">{html(point.look.icon)}</text></g>'
    )


def _middle(place: int) -> float:
    return _HEAD + _ROW * place + _ROW / 2


def _cut(text: str, pixels: float) -> str:
    """Return as much of a text as there is room for; nothing when that would mean nothing."""
    letters = int(pixels / _LETTER)
    if len(text) <= letters:
        return text
    return f"{text[: letters - 1]}\N{HORIZONTAL ELLIPSIS}" if letters > 3 else ""  # noqa: PLR2004 - no word
