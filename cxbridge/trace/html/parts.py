"""Renders pieces of pages as HTML. Every text given to them is escaped here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from cxbridge.history.outcome import OutcomeKind, goal_outcome
from cxbridge.trace.html.text import html

UNKNOWN = ("", "UNKNOWN")
"""What the slot ``outcome`` has of a goal without one."""

DEEPEST = 12
"""Levels of a tree that are indented; deeper ones are below each other and show their level."""


@dataclass(frozen=True, slots=True)
class Look:
    """The look of a state that is not an outcome.

    :param tone: the CSS class without ``t-``; base.css gives it a colour in light, dark and print.
    :param icon: one character.
    """

    tone: str
    icon: str


@dataclass(frozen=True, slots=True)
class GoalNode:
    """A goal in a tree.

    :param error: its error, empty for none.
    :param note: what the page has to say of it; ``marked`` draws the eye to it.
    """

    goal: str
    goal_class: str
    mode: str
    outcome: str = "UNKNOWN"
    error: str = ""
    note: str = ""
    marked: bool = False
    children: Sequence[GoalNode] = ()


def badge(look: Look | OutcomeKind, text: str) -> str:
    """Return a state: its icon, and its name in its colour."""
    return f'<span class="badge t-{look.tone}"><i aria-hidden="true">{look.icon}</i>{html(text)}</span>'


def goal_badge(mode: str, outcome: str) -> str:
    """Return a goal's mode, and its outcome when it has one."""
    text = mode if outcome in UNKNOWN else f"{mode} {outcome}"
    return badge(goal_outcome(mode, outcome), text)


def goal_tree(roots: Sequence[GoalNode], label: str) -> str:
    """Return a tree of goals, which arrow keys walk, open and close.

    :param label: what tree it is, for screen readers.
    """
    if not roots:
        return '<p class="none">no goals</p>'
    rows = "".join(_tree_row(node, depth) for node, depth in _walk(roots))
    return f'<ul class="tree" role="tree" aria-label="{html(label)}">{rows}</ul>'


def table(
    head: Sequence[str], rows: Sequence[Sequence[str]], *, caption: str = "", numbers: Sequence[int] = ()
) -> str:
    """Return a table.

    :param head: titles of the columns, plain text.
    :param rows: HTML of the cells.
    :param numbers: which columns are numbers, from 0.
    """
    classes = [' class="n"' if column in numbers else "" for column in range(len(head))]
    top = "".join(f'<th scope="col"{cls}>{html(text)}</th>' for text, cls in zip(head, classes, strict=True))
    body = "".join(
        "<tr>" + "".join(f"<td{cls}>{cell}</td>" for cell, cls in zip(row, classes, strict=True)) + "</tr>"
        for row in rows
    )
    title = f"<caption>{html(caption)}</caption>" if caption else ""
    return f'<div class="wide"><table>{title}<thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


def pairs(values: Mapping[str, str]) -> str:
    """Return names and their values, below each other."""
    rows = "".join(f"<dt>{html(name)}</dt><dd>{html(value)}</dd>" for name, value in values.items())
    return f'<dl class="pairs">{rows}</dl>'


def rules_list(rules: Sequence[str], label: str) -> str:
    """Return rules (or other lines of a program), the oldest first."""
    if not rules:
        return '<p class="none">no firings recorded</p>'
    rows = "".join(f"<li><code>{html(rule)}</code></li>" for rule in rules)
    return f'<ol class="rules" aria-label="{html(label)}">{rows}</ol>'


def notes(texts: Sequence[str]) -> str:
    """Return what the reader must know before all else."""
    return "".join(f'<p class="note" role="note">{html(text)}</p>' for text in texts)


def legend() -> str:
    """Return what the colours and icons of goals mean."""
    items = [badge(kind, kind.word) for kind in OutcomeKind]
    return '<p class="legend" aria-label="Legend">' + " ".join(items) + "</p>"


def _tree_row(node: GoalNode, depth: int) -> str:
    """Return one goal of a tree."""
    marked = " marked" if node.marked else ""
    opened = ' aria-expanded="true"' if node.children else ""
    error = f' <span class="error">{html(node.error)}</span>' if node.error else ""
    note = f' <span class="remark">{html(node.note)}</span>' if node.note else ""
    return (
        f'<li role="treeitem" aria-level="{depth + 1}" tabindex="-1" '
        f'class="d{min(depth, DEEPEST)}{marked}"{opened}>'
        f"<b>{html(node.goal)}</b> <span>{html(node.goal_class)}</span> "
        f"{goal_badge(node.mode, node.outcome)}{error}{note}</li>"
    )


def _walk(roots: Sequence[GoalNode]) -> Iterator[tuple[GoalNode, int]]:
    """Yield the goals of a tree, parents before children, with their depth: trees may be very deep."""
    stack = [(root, 0) for root in reversed(roots)]
    while stack:
        node, depth = stack.pop()
        yield node, depth
        stack += [(child, depth + 1) for child in reversed(node.children)]
