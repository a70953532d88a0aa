"""Makes the page about a game."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from cxbridge.history.outcome import OutcomeKind, skill_outcome
from cxbridge.trace.html.chart import STYLE as CHART_STYLE
from cxbridge.trace.html.page import Page, Section
from cxbridge.trace.html.parts import Look, badge, notes, table
from cxbridge.trace.html.text import html
from cxbridge_explore.game.page.lanes import STYLE as LANES_STYLE
from cxbridge_explore.game.page.lanes import Bar, Lane, LaneGroup, LanePoint, draw
from cxbridge_explore.game.page.points import STYLE as POINTS_STYLE
from cxbridge_explore.game.page.points import draw_points
from cxbridge_explore.game.score import GameResult, ProductOrder, Score
from cxbridge_explore.game.timeline import Span, Timeline, within

_NOTHING: Final = Look("new", "○")
_BUSY: Final = OutcomeKind.RUNNING
_FULL: Final = Look("bound", "◕")
_WINDOW: Final = Look("planned", "◑")
_DELIVERED, _LATE = OutcomeKind.COMPLETED, OutcomeKind.FAILED
_OTHER: Final = Look("other", "?")
_MACHINES: Final[Mapping[str, Look | OutcomeKind]] = {
    "free": _NOTHING,
    "busy": _BUSY,
    "full": _FULL,
    "IDLE": _NOTHING,
    "PREPARED": Look("chosen", "◔"),
    "PROCESSING": _BUSY,
    "PROCESSED": Look("planned", "◑"),
    "READY-AT-OUTPUT": _FULL,
    "WAIT-IDLE": Look("ended", "■"),
    "DOWN": OutcomeKind.REJECTED,
    "BROKEN": OutcomeKind.FAILED,
}
"""The states of machines: those of published ones, and those of the league."""

_NAME: Final = re.compile(r"[\w.-]+")
_VALUE: Final = re.compile(r'=\s*(?:"([^"]*)"|([^\s,}"]+))')


def write_page(result: GameResult, file: Path, command: str) -> None:
    """Write the page.

    :param command: what makes it once more.
    :raises CxbridgeError: when the file cannot be written.
    """
    score, timeline = result.score, result.timeline
    Page(
        title=f"Game of seed {result.seed}",
        lead=_lead(result, command) + notes([*result.faults, *result.undefined]),
        sections=[
            Section("points", "Points over time", draw_points(score, timeline.seconds)),
            Section("categories", "What the points are for", _categories(score)),
            Section("timeline", "Timeline", _timeline(score, timeline)),
            Section("robots", "Robots", _robots(result)),
            Section("machines", "Machines", _machines(timeline)),
            Section("orders", "Orders", _orders(score)),
            Section("awards", "Each award", _awards(score)),
        ],
        styles=[CHART_STYLE, LANES_STYLE, POINTS_STYLE],
    ).write(file)


def _lead(result: GameResult, command: str) -> str:
    score = result.score
    points = ", ".join(f"{team} {points}" for team, points in score.points.items())
    ended = "over" if result.is_over else f"not over, in {score.phase}"
    tests = f"; the agent's own tests: {result.simtest}" if result.simtest else ""
    said = (
        f"{points} points; {len(score.deliveries)} deliveries; the game is {ended} after "
        f"{score.game_time:g} s{tests}"
    )
    return f'<p class="verdict">{html(said)}</p><p><code>{html(command)}</code></p>'


def _categories(score: Score) -> str:
    rows = [
        [html(team), html(category), str(points)]
        for team, categories in score.categories.items()
        for category, points in sorted(categories.items(), key=lambda item: -item[1])
    ]
    return table(["team", "category", "points"], rows, numbers=(2,)) if rows else _none("no points")


def _timeline(score: Score, timeline: Timeline) -> str:
    skills, states = timeline.skills, timeline.machines
    still = sorted(name for name, spans in states.items() if len(spans) < 2 and name not in skills)  # noqa: PLR2004
    robots = [Lane(name, _skill_bars(skills[name], timeline)) for name in skills if name not in states]
    machines = []
    for name in states:
        if name not in still:
            machines.append(Lane(name, [*_state_bars(states[name])]))
            if name in skills:
                machines.append(Lane(f"{name}: skills", _skill_bars(skills[name], timeline)))
    groups = [
        LaneGroup("Robots", robots),
        LaneGroup("Machines", machines),
        LaneGroup("Orders", [_order_lane(order, score) for order in score.orders]),
    ]
    idle = f"Machines that did nothing: {', '.join(still)}. " if still else ""
    label = "What robots, machines and orders did when; the tables below sum it up"
    return (
        _legend(timeline)
        + draw(groups, timeline.seconds, label)
        + f'<p class="dim">Seconds of the production. {html(idle)}Point at a bar to see more.</p>'
    )


def _legend(timeline: Timeline) -> str:
    statuses = dict.fromkeys(span.status for spans in timeline.skills.values() for span in spans)
    states = dict.fromkeys(span.text for spans in timeline.machines.values() for span in spans)
    items = [badge(skill_outcome(status), f"skill {status}") for status in sorted(statuses)]
    items += [badge(_MACHINES.get(state, _OTHER), f"machine {state}") for state in states]
    items += [
        badge(_WINDOW, "time of delivery"),
        badge(_DELIVERED, "delivered in time"),
        badge(_LATE, "delivered at another time"),
    ]
    return f'<p class="legend" aria-label="Legend">{" ".join(items)}</p>'


def _skill_bars(spans: tuple[Span, ...], timeline: Timeline) -> list[Bar]:
    bars = []
    for span in within(spans, timeline.seconds):
        look = skill_outcome(span.status)
        mark = look.icon if look is OutcomeKind.FAILED else ""
        text = f"{mark} {_short(span.text)}".strip()
        why = f": {span.error}" if span.error else ""
        title = f"{span.text}\n{span.status}{why}\n{_times(span)}"
        bars.append(Bar(span.begin, span.end, look, text, title, mark))
    return bars


def _state_bars(spans: tuple[Span, ...]) -> Iterator[Bar]:
    for span in spans:
        look = _MACHINES.get(span.text, _OTHER)
        if look != _NOTHING:
            yield Bar(span.begin, span.end, look, span.text, f"{span.text}\n{_times(span)}")


def _order_lane(order: ProductOrder, score: Score) -> Lane:
    window = f"{order.begin:g} to {order.end:g} s"
    points = [
        LanePoint(at, _DELIVERED if _in_time(order, at) else _LATE, f"delivered at {at:g} s; time: {window}")
        for at in score.delivered(order)
    ]
    bar = Bar(order.begin, order.end, _WINDOW, order.complexity, f"{order.complexity}: {window}")
    return Lane(f"{order.order}: {order.complexity}", [bar], points)


def _in_time(order: ProductOrder, at: float) -> bool:
    return order.begin <= at <= order.end


def _times(span: Span) -> str:
    return f"{span.begin:.1f} to {span.end:.1f} s ({span.end - span.begin:.1f} s)"


def _short(skill: str) -> str:
    """Return a skill without the names of its parameters: ``moveto C-BS``."""
    name = _NAME.match(skill)
    if name is None:
        return skill
    return " ".join((name[0], *(quoted or plain for quoted, plain in _VALUE.findall(skill))))


def _robots(result: GameResult) -> str:
    rows = [
        [
            html(name),
            f"{work.busy_seconds:.1f}",
            f"{work.idle_seconds:.1f}",
            str(len(result.timeline.skills.get(name, ()))),
            html("; ".join(f"{count} times: {error}" for error, count in work.failed.items())),
        ]
        for name, work in result.robots.items()
    ]
    head = ["name", "busy, s", "idle, s", "skills", "failed"]
    return table(head, rows, numbers=(1, 2, 3)) if rows else _none("no robot has executed a skill")


def _machines(timeline: Timeline) -> str:
    use = timeline.machine_use
    states = list(dict.fromkeys(state for seconds in use.values() for state in seconds))
    rows = [
        [html(name), *(f"{seconds[state]:.1f}" if state in seconds else "" for state in states)]
        for name, seconds in use.items()
    ]
    if not rows:
        return _none("no machine has told its state")
    return table(["seconds in the state", *states], rows, numbers=range(1, len(states) + 1))


def _orders(score: Score) -> str:
    rows = []
    for order in score.orders:
        times = score.delivered(order)
        words = [f"{at:g}" if _in_time(order, at) else f"{at:g} (not in time)" for at in times]
        rows.append(
            [
                str(order.order),
                html(order.complexity),
                f"{order.begin:g}",
                f"{order.end:g}",
                html(", ".join(words)) or "-",
            ]
        )
    head = ["order", "what", "from, s", "until, s", "delivered, s"]
    return table(head, rows, numbers=(0, 2, 3)) if rows else _none("no orders")


def _awards(score: Score) -> str:
    rows = [
        [f"{each.game_time:.1f}", html(each.phase), html(each.team), f"{each.points:+d}", html(each.reason)]
        for each in score.awards
    ]
    head = ["s", "phase", "team", "points", "reason"]
    return table(head, rows, numbers=(0, 3)) if rows else _none("no points")


def _none(text: str) -> str:
    return f'<p class="none">{html(text)}</p>'
