"""The page about a sweep: outcomes, durations and goals, and the seeds to look at."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final

from cxbridge.trace.html.page import Page, Section
from cxbridge.trace.html.parts import notes, table
from cxbridge.trace.html.text import html
from cxbridge_explore.sweep.rows import RunRow
from cxbridge_explore.sweep.statistics import Interval
from cxbridge_explore.sweep.summary import AgentComparison, SweepSummary

_BINS: Final = 40
_WIDTH, _HEIGHT, _FOOT = 720, 180, 18
_STYLE: Final = """
.plot { width: 100%; max-width: 45rem; height: auto; }
.plot rect { fill: #2f6fb2; }
.plot text { font-size: 12px; fill: currentColor; }
"""


def write_page(sweeps: Mapping[str, Sequence[RunRow]], file: Path, command: str) -> None:
    """Write the page about a sweep of one agent, or of two on the same seeds.

    :param sweeps: rows by the agent's name.
    :param command: what makes the page once more.
    :raises CxbridgeError: when the file cannot be written.
    """
    page = Page(
        title=f"Sweep of {' and '.join(sweeps)}",
        lead=f"<p><code>{html(command)}</code></p>",
        sections=[*_sections(sweeps)],
        styles=[_STYLE],
    )
    page.write(file)


def _sections(sweeps: Mapping[str, Sequence[RunRow]]) -> Iterator[Section]:
    summaries = {name: SweepSummary(rows) for name, rows in sweeps.items()}
    if len(sweeps) > 1:
        first, second = sweeps.values()
        yield Section("comparison", "Comparison", _comparison(first, second))
    yield Section("outcomes", "Outcomes", "".join(_outcomes(*item) for item in summaries.items()))
    yield Section("makespan", "Makespan", "".join(_makespan(*item) for item in summaries.items()))
    yield Section("goals", "Goals", "".join(_goals(*item) for item in summaries.items()))


def _comparison(first: Sequence[RunRow], second: Sequence[RunRow]) -> str:
    compared = AgentComparison({row.seed: row for row in first}, {row.seed: row for row in second})
    rows = [["completed runs, difference", *_cells(compared.completed, 100, "%")]]
    if compared.makespan is not None:
        rows.append(["makespan, difference", *_cells(compared.makespan, 1, "s")])
    seeds = [
        [str(each["seed"]), *map(html, each["outcomes"]), *(f"{value:.2f}" for value in each["makespans"])]
        for each in compared.as_dict()["seeds"]
    ]
    names = ("seed", "first", "second", "first, s", "second, s")
    return table(
        ("second minus first", "estimate", "95 % interval", "verdict"), rows, numbers=(1, 2)
    ) + table(names, seeds, caption="Seeds in which they differ most", numbers=(0, 3, 4))


def _cells(interval: Interval, scale: float, unit: str) -> list[str]:
    verdict = "differ" if interval.excludes_zero else "no difference is seen"
    return [
        f"{interval.estimate * scale:+.3g} {unit}",
        interval.span("+.3g", scale=scale, unit=f" {unit}"),
        verdict,
    ]


def _outcomes(name: str, summary: SweepSummary) -> str:
    total = len(summary.rows)
    rows = [
        [
            html(outcome),
            str(count),
            f"{100 * count / total:.2f} %",
            ", ".join(map(str, summary.seeds_of(outcome))),
        ]
        for outcome, count in summary.outcomes.items()
    ]
    return table(
        ("outcome", "runs", "share", "first seeds"), rows, caption=f"{name}: {total} runs", numbers=(1, 2)
    )


def _makespan(name: str, summary: SweepSummary) -> str:
    quantiles = summary.makespan
    if quantiles is None:
        return notes([f"{name}: no run was completed."])
    values = [row.makespan for row in summary.rows if row.is_completed]
    found = quantiles.as_dict()
    return table(
        [*found], [[f"{value:.2f}" for value in found.values()]], caption=f"{name}: seconds", numbers=range(8)
    ) + _histogram(values, f"Makespan of {name}")


def _goals(name: str, summary: SweepSummary) -> str:
    outcomes = sorted({outcome for counts in summary.goals.values() for outcome in counts})
    rows = [
        [html(goal_class), *(str(counts.get(outcome, 0)) for outcome in outcomes)]
        for goal_class, counts in summary.goals.items()
    ]
    return table(("class", *outcomes), rows, caption=name, numbers=range(1, len(outcomes) + 1))


def _histogram(values: Sequence[float], label: str) -> str:
    """Return how values are distributed, as a picture."""
    low, high = min(values), max(values)
    width = (high - low) / _BINS or 1.0
    counts = [0] * _BINS
    for value in values:
        counts[min(int((value - low) / width), _BINS - 1)] += 1
    step, top = _WIDTH / _BINS, max(counts)
    bars = "".join(
        f'<rect x="{left:.1f}" y="{_HEIGHT - height:.1f}" width="{right - left - 1:.1f}" '
        f'height="{height:.1f}">'
        f"<title>{low + number * width:.2f} to {low + (number + 1) * width:.2f} s: {count}</title></rect>"
        for number, ((left, right), count) in enumerate(
            zip(pairwise(number * step for number in range(_BINS + 1)), counts, strict=True)
        )
        if (height := _HEIGHT * count / top)
    )
    foot, box = _HEIGHT + _FOOT - 4, f"0 0 {_WIDTH} {_HEIGHT + _FOOT}"
    return (
        f'<svg class="plot" role="img" aria-label="{html(label)}" viewBox="{box}">{bars}'
        f'<text x="0" y="{foot}">{low:.2f} s</text>'
        f'<text x="{_WIDTH}" y="{foot}" text-anchor="end">{high:.2f} s</text></svg>'
    )
