"""Draws the points over time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from cxbridge.trace.html.chart import Axis
from cxbridge.trace.html.text import html
from cxbridge_explore.game.judge import PRODUCTION
from cxbridge_explore.game.score import POST_GAME, Award, Score

_WIDTH, _HEIGHT, _HEAD, _RIGHT = 1100, 220, 22, 120
_TICKS: Final = 6

STYLE: Final = """
.points { width: 100%; min-width: 40rem; height: auto; }
.points text { font-size: 12px; fill: currentColor; }
.points path { fill: none; stroke-width: 2; }
.points .team0 { stroke: var(--link); } .points .team1 { stroke: #c77700; }
.points circle { fill: var(--back); stroke-width: 2; }
"""


def draw_points(score: Score, seconds: float) -> str:
    """Return the drawing.

    :param seconds: of the production.
    """
    if not score.awards:
        return '<p class="none">no points</p>'
    axis = Axis(seconds if seconds > 0 else 1.0, 4, _WIDTH - _RIGHT)
    teams = {
        team: [award for award in score.awards if award.team == team and award.points]
        for team in score.points
    }
    sums = {team: _sums(awards) for team, awards in teams.items()}
    low, high = (choose(0, *(value for each in sums.values() for value in each)) for choose in (min, max))
    scale = (_HEIGHT - _HEAD - 10) / ((high - low) or 1)
    body = "".join(axis.ticks(axis.parts(_TICKS), _HEAD - 4, _HEIGHT))
    for number, (team, awards) in enumerate(team for team in teams.items() if team[1]):
        heights = [_HEIGHT - 4 - (value - low) * scale for value in (0, *sums[team])]
        body += "".join(_steps(awards, heights, axis, f"team{number % 2}"))
        label = html(f"{team} {sums[team][-1]}")
        body += f'<text x="{axis.left + axis.width + 6}" y="{heights[-1] + 4:.1f}">{label}</text>'
    label = html("Points over time; the table of points below has the same")
    return (
        f'<div class="wide"><svg class="points" viewBox="0 0 {_WIDTH} {_HEIGHT + 4}" role="img" '
        f'aria-label="{label}">{body}</svg></div>'
    )


def second_of(award: Award, seconds: float) -> float:
    """Return the second of the production when points were given; those of other phases are at its ends."""
    return min(award.game_time, seconds) if award.phase in (PRODUCTION, POST_GAME) else 0.0


def _sums(awards: Sequence[Award]) -> list[int]:
    total, found = 0, []
    for award in awards:
        total += award.points
        found.append(total)
    return found


def _steps(awards: Sequence[Award], heights: Sequence[float], axis: Axis, team: str) -> Iterator[str]:
    """Yield the line of a team.

    :param heights: one before the first of the awards, and one after each.
    """
    times = [axis.at(second_of(award, axis.seconds)) for award in awards]
    steps = "".join(f" H{at:.1f} V{height:.1f}" for at, height in zip(times, heights[1:], strict=True))
    yield f'<path class="{team}" d="M{axis.left} {heights[0]:.1f}{steps} H{axis.left + axis.width}"/>'
    for award, at, height in zip(awards, times, heights[1:], strict=True):
        title = html(f"{award.game_time:g} s: {award.points:+d} {award.reason}")
        yield f'<g><title>{title}</title><circle class="{team}" cx="{at:.1f}" cy="{height:.1f}" r="3"/></g>'
