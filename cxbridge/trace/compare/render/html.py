"""Renders a comparison as one page that works offline."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from cxbridge.file_access import write_file
from cxbridge.trace.compare.model import (
    AlignedRow,
    Comparison,
    Difference,
    DifferenceContext,
    EventLine,
    GoalAtDifference,
    Side,
)
from cxbridge.trace.compare.render.text import ComparisonReport, short, summary
from cxbridge.trace.html.page import Page, Section, asset
from cxbridge.trace.html.parts import GoalNode, goal_tree, legend, notes, rules_list, table
from cxbridge.trace.html.text import html

LISTED: Final = 200
"""So many differences are listed after the first."""

_SIGNS: Final = {
    "changed": "≠",
    "only-a": "\u2212",
    "only-b": "+",
    "order": "⇅",
    "msgid": "#",
    "time": "◷",
    "count": "\u00d7",
}


def write_page(
    path: Path, report: ComparisonReport, options: Sequence[str] = (), unused: Sequence[str] = ()
) -> None:
    """Write the page.

    :param options: how it was compared, a line each.
    :param unused: entries of the baseline that no difference met.
    :raises CxbridgeError: when the file cannot be written.
    """
    write_file(path, render(report, options, unused))


def render(report: ComparisonReport, options: Sequence[str] = (), unused: Sequence[str] = ()) -> str:
    """Return the page."""
    comparison = report.comparison
    remarks = [*report.a.notes, *report.b.notes, *(f"not met: {entry}" for entry in unused)]
    verdict = "same" if comparison.same else "differ"
    lead = (
        f'<p class="verdict {verdict}"><i aria-hidden="true">{"=" if comparison.same else "≠"}</i>'
        f"{html(summary(comparison))}</p>"
        f'<dl class="pairs"><dt>A</dt><dd>{html(report.a.path)}</dd><dt>B</dt><dd>{html(report.b.path)}</dd>'
        f"{''.join(f'<dt>compared</dt><dd>{html(each)}</dd>' for each in options)}</dl>"
        f"{notes([*comparison.hints, *remarks])}"
    )
    return Page(
        title=f"{report.a.path.name} and {report.b.path.name}",
        lead=lead,
        sections=_sections(report),
        styles=(asset("page.css", "cxbridge.trace.compare.render"),),
    ).render()


def _sections(report: ComparisonReport) -> list[Section]:
    """Return the parts of the page."""
    comparison = report.comparison
    sections = []
    if comparison.differences:
        first = comparison.differences[0]
        sections.append(Section("first", "First difference", _first(first)))
        if comparison.rows:
            sections.append(Section("around", "Side by side", _rows(comparison.rows)))
        else:
            bodies = [_events(context.lines) for _, _, context in report.sides]
            sections.append(Section("around", "What led to it", _sides(bodies)))
        rules = [rules_list(context.rules, f"rules of {name}") for name, _, context in report.sides]
        sections.append(Section("rules", "Rules that fired just before", _sides(rules)))
        goals = _goal_trees(report.context_a, report.context_b)
        sections.append(Section("goals", "Goals at that point", f"{_sides(goals)}{legend()}"))
    if len(comparison.differences) > 1 or comparison.dropped:
        sections.append(Section("further", "Further differences", _further(comparison)))
    if comparison.accepted:
        rows = [[*_cells(each.difference), html(each.reason)] for each in comparison.accepted]
        body = table(["", "what", "A", "B", "reason"], rows)
        sections.append(Section("accepted", "Accepted differences", body))
    return sections


def _first(difference: Difference) -> str:
    """Return what was expected and what came."""
    subject = f"<b>{html(short(difference.subject))}</b>: " if difference.subject else ""
    bodies = [_side("expected, in A", difference.a), _side("came, in B", difference.b)]
    return f"<p>{_sign(difference)} {subject}{html(difference.what)}</p>{_sides(bodies)}"


def _side(name: str, side: Side) -> str:
    """Return what one run has."""
    number = "" if side.number is None else f' <span class="dim">event {side.number}</span>'
    return f'<p class="dim">{name}{number}</p><p class="code">{html(short(side.text))}</p>'


def _sides(bodies: Sequence[str]) -> str:
    """Return A and B next to each other."""
    boxes = "".join(
        f'<div><h3 class="side">{name}</h3>{body}</div>' for name, body in zip("AB", bodies, strict=True)
    )
    return f'<div class="sides">{boxes}</div>'


def _rows(rows: Sequence[AlignedRow]) -> str:
    """Return both runs as one table, partners on the same line."""
    body = "".join(
        f'<tr class="{_row_class(row)}">{_line_cells(row.a)}<td class="sign">{_row_sign(row)}</td>'
        f"{_line_cells(row.b)}</tr>"
        for row in rows
    )
    return (
        '<div class="wide"><table class="aligned"><thead><tr><th scope="col" colspan="3">A</th>'
        f'<th></th><th scope="col" colspan="3">B</th></tr></thead><tbody>{body}</tbody></table></div>'
    )


def _row_class(row: AlignedRow) -> str:
    if row.same:
        return "same"
    return "one" if row.a is None or row.b is None else "changed"


def _row_sign(row: AlignedRow) -> str:
    """Return how two events stand to each other, as a sign and for screen readers."""
    if row.same:
        return ""
    if row.b is None:
        return '<span role="img" aria-label="only A has it">\u2212</span>'
    return f'<span role="img" aria-label="{"only B has it" if row.a is None else "differ"}">' + (
        "+</span>" if row.a is None else "≠</span>"
    )


def _line_cells(line: EventLine | None) -> str:
    """Return the cells of an event: number, time, text."""
    if line is None:
        return '<td class="gap" colspan="3"></td>'
    text = html(short(line.text))
    return (
        f'<td class="n">{line.number}</td><td class="n dim">{line.seconds:.3f} s</td>'
        f'<td class="what"><code>{f"<b>{text}</b>" if line.here else text}</code></td>'
    )


def _events(lines: Sequence[EventLine]) -> str:
    """Return the events that led to a difference on one side."""
    if not lines:
        return '<p class="none">nothing</p>'
    rows = [
        [
            str(line.number),
            f"{line.seconds:.3f}",
            f"<code>{'<b>' if line.here else ''}{html(short(line.text))}{'</b>' if line.here else ''}</code>",
        ]
        for line in lines
    ]
    return table(["event", "seconds", "what"], rows, numbers=(0, 1))


def _goal_trees(a: DifferenceContext, b: DifferenceContext) -> list[str]:
    """Return the goals of both sides; what the other side has not in the same place is marked."""
    states = [[_state(line) for line in context.goals] for context in (a, b)]
    return [
        goal_tree(_nodes(context.goals, states[1 - side]), f"goals of {'AB'[side]}")
        for side, context in enumerate((a, b))
    ]


def _state(line: GoalAtDifference) -> tuple[object, ...]:
    """Return what of a goal is the same in every run."""
    return (line.depth, line.goal_class, line.mode, line.outcome)


def _nodes(lines: Sequence[GoalAtDifference], others: Sequence[tuple[object, ...]]) -> list[GoalNode]:
    """Return a tree of goals."""
    left = list(others)
    above: list[list[GoalNode]] = [[]]
    for line in lines:
        marked = _state(line) not in left
        if not marked:
            left.remove(_state(line))
        children: list[GoalNode] = []
        del above[line.depth + 1 :]
        node = GoalNode(
            goal=line.goal,
            goal_class=line.goal_class,
            mode=line.mode,
            outcome=line.outcome,
            error=line.error,
            note="the other side has not" if marked else "",
            marked=marked,
            children=children,
        )
        above[line.depth].append(node)
        above.append(children)
    return above[0]


def _further(comparison: Comparison) -> str:
    """Return the differences after the first."""
    more = comparison.differences[1 : LISTED + 1]
    body = table(["", "what", "A", "B"], [_cells(difference) for difference in more])
    left = comparison.total - 1 - len(more)
    return body + (f'<p class="dim">and {left} more</p>' if left else "")


def _cells(difference: Difference) -> list[str]:
    """Return the cells of a difference."""
    subject = f"<b>{html(short(difference.subject))}</b><br>" if difference.subject else ""
    sides = []
    for side in (difference.a, difference.b):
        number = "" if side.number is None else f'<span class="dim">{side.number}</span> '
        sides.append(f"{number}<code>{html(short(side.text))}</code>")
    return [_sign(difference), f"{subject}{html(difference.what)}", *sides]


def _sign(difference: Difference) -> str:
    """Return the sort of difference as a sign."""
    kind = difference.kind.value
    return f'<span class="sign" role="img" aria-label="{kind}" title="{kind}">{_SIGNS[kind]}</span>'
