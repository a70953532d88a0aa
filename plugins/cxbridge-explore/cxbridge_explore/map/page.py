"""The page about an exploration: a map of its runs, what failures lead to, and what no run has reached."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from cxbridge.history.outcome import goal_outcome
from cxbridge.trace.html.chart import STYLE as CHART_STYLE
from cxbridge.trace.html.page import Page, Section
from cxbridge.trace.html.parts import badge, goal_badge, notes, table
from cxbridge.trace.html.text import html
from cxbridge_explore.map.coverage import never_fired
from cxbridge_explore.map.drawing import STYLE, draw
from cxbridge_explore.map.rows import MapRow, run_rows
from cxbridge_explore.result import ExploreResult
from cxbridge_studio.explain.coverage.model import Coverage

MOST_DRAWN: Final = 400
"""Rows; of more, those with the fewest faults and those that violate a property are drawn."""

_FINISHED: Final = "FINISHED"


def write_page(result: ExploreResult, coverage: Coverage, file: Path, command: str) -> None:
    """Write the page.

    :param command: what makes it once more.
    :raises CxbridgeError: when the file cannot be written.
    """
    rows = run_rows(result.graph)
    drawn = _drawn(rows)
    remarks = (
        [] if len(drawn) == len(rows) else [f"{len(rows) - len(drawn)} runs of {len(rows)} are not drawn"]
    )
    page = Page(
        title="Exploration",
        lead=_lead(result, command) + notes(remarks),
        sections=[
            Section("map", "Runs", draw([rows[number] for number in drawn], drawn)),
            Section("faults", "What faults lead to", _faults(rows)),
            Section("properties", "Properties", _properties(result)),
            Section("unreached", "What no run has reached", _unreached(coverage)),
            Section("goals", "Goals", _goals(coverage)),
        ],
        styles=[CHART_STYLE, STYLE],
    )
    page.write(file)


def _drawn(rows: Sequence[MapRow]) -> list[int]:
    """Return the numbers of the rows that are drawn, with those that they left."""
    wanted = sorted(range(len(rows)), key=lambda number: (not rows[number].violations, rows[number].faults))
    drawn: set[int] = set()
    for number in wanted:
        line: list[int] = []
        above: int | None = number
        while above is not None and above not in drawn:
            line.append(above)
            above = rows[above].parent
        if len(drawn) + len(line) <= MOST_DRAWN:
            drawn.update(line)
    return sorted(drawn)


def _lead(result: ExploreResult, command: str) -> str:
    graph = result.graph
    counts = ", ".join(f"{count} {html(outcome)}" for outcome, count in result.outcomes.items())
    end = "complete" if result.is_complete else f"not complete: {len(graph.open)} branches are open"
    return (
        f'<p class="verdict">{len(graph.leaves)} runs, {len(graph.nodes)} states, {graph.merged} merged; '
        f"{end}. {counts}</p><p><code>{html(command)}</code></p>"
    )


def _faults(rows: Sequence[MapRow]) -> str:
    """Return a table of the choices at which runs branched off, with the ends of those runs."""
    found: dict[str, Counter[str]] = {}
    for row in rows:
        if row.choice:
            found.setdefault(row.choice, Counter())[row.outcome] += 1
    if not found:
        return '<p class="none">the world had no choice</p>'
    lines = [
        [html(choice), str(ends.total()), html(", ".join(f"{count} {name}" for name, count in ends.items()))]
        for choice, ends in sorted(found.items(), key=lambda item: (-item[1].total(), item[0]))
    ]
    return table(["choice", "runs", "ended"], lines, numbers=(1,))


def _properties(result: ExploreResult) -> str:
    violated = {each["property"]: each for each in result.violations}
    vacuous = set(result.vacuous)
    lines = []
    for name in sorted({each.name for each in result.properties} | violated.keys()):
        found = violated.get(name)
        if found is not None:
            lines.append([html(name), "<b>violated</b>", html(found.get("words") or found["message"])])
        elif name in vacuous:
            lines.append([html(name), "vacuous", "no run could have violated it"])
        else:
            lines.append([html(name), "holds", ""])
    return table(["property", "", ""], lines)


def _unreached(coverage: Coverage) -> str:
    lines = [["rule", f"{html(name)}:{line}", html(rule)] for name, line, rule in never_fired(coverage)]
    lines += [["goal class", "", html(name)] for name in coverage.classes.unused]
    lines += [["action", "", html(name)] for name in coverage.actions.unused]
    verdict = f"<p>{coverage.fired} of {coverage.counted} rules fired: {coverage.percent:.1f} %</p>"
    return verdict + (table(["what", "where", "name"], lines) if lines else "")


def _goals(coverage: Coverage) -> str:
    if not coverage.classes.used:
        return '<p class="none">no goals</p>'
    return table(["class", "outcomes", "never in the mode"], list(_goal_lines(coverage)))


def _goal_lines(coverage: Coverage) -> Iterator[list[str]]:
    missing, outcomes = dict(coverage.missing_modes), dict(coverage.outcomes)
    for name, _ in coverage.classes.used:
        ends = " ".join(goal_badge(_FINISHED, outcome) for outcome, _ in outcomes.get(name, ()))
        never = " ".join(badge(goal_outcome(mode, ""), mode) for mode in missing.get(name, ()))
        yield [html(name), ends or "-", never or "-"]
