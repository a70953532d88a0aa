"""What led to a difference: the events before it, the rules that fired, the goals at that point."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, GoalTransition, RuleFired
from cxbridge.trace.compare.naming import describe
from cxbridge.trace.formats.base import Run
from cxbridge.trace.levels import View

LINES_BEFORE = 6
"""How many events are shown before the one at the difference."""

LINES_AFTER = 2
"""How many are shown after it."""

RULES_BEFORE = 5
"""How many firings before it are shown."""


@dataclass(frozen=True, slots=True)
class Line:
    """An event that is shown.

    :param number: its number among those of the view, from 1.
    :param seconds: time since the first event of the run.
    :param here: whether it is the one at the difference.
    """

    number: int
    seconds: float
    text: str
    here: bool


@dataclass(frozen=True, slots=True)
class Context:
    """What led to a difference on one side.

    :param lines: the events around it.
    :param rules: the firings just before it, when the run has firings.
    :param goals: the goals that are not retracted at that point, as an indented tree.
    """

    lines: list[Line] = field(default_factory=list)
    rules: list[str] = field(default_factory=list)
    goals: list[str] = field(default_factory=list)


def context_of(run: Run, view: View, position: int | None) -> Context:
    """Read a run up to an event, and return what led to it.

    :param position: the event's number among those of the view, from 0; None: nothing is found.
    """
    if position is None:
        return Context()
    lines: deque[Line] = deque(maxlen=LINES_BEFORE + 1)
    rules: deque[RuleFired] = deque(maxlen=RULES_BEFORE)
    tree = _GoalTree()
    start_us: int | None = None
    number = 0
    found: Context | None = None
    for event in run:
        start_us = event.time_us if start_us is None else start_us
        if isinstance(event, view.event_types):
            seconds = (event.time_us - start_us) / MICROSECONDS
            line = Line(number + 1, seconds, describe(event), number == position)
            if found is not None:
                found.lines.append(line)
                if number >= position + LINES_AFTER:
                    return found
            lines.append(line)
            number += 1
        if found is None:
            _take(event, rules, tree)
            if number == position + 1:
                found = Context(list(lines), [describe(rule) for rule in rules], list(tree.lines()))
    return found or Context()


def _take(event: Event, rules: deque[RuleFired], tree: _GoalTree) -> None:
    """Remember an event that may have led to the difference."""
    if isinstance(event, RuleFired):
        rules.append(event)
    elif isinstance(event, GoalTransition):
        tree.take(event)


class _GoalTree:
    """The goals as they are at one point of a run."""

    def __init__(self) -> None:
        self._goals: dict[str, GoalTransition] = {}

    def take(self, event: GoalTransition) -> None:
        """Take the next transition."""
        self._goals[event.goal] = event

    def lines(self) -> Iterator[str]:
        """Yield one line a goal, children indented below their parent; retracted roots are left out."""
        children: dict[str, list[GoalTransition]] = {}
        for goal in self._goals.values():
            parent = goal.parent if goal.parent in self._goals else ""
            children.setdefault(parent, []).append(goal)
        roots = [goal for goal in children.get("", []) if goal.mode != "RETRACTED"]
        stack = [(goal, 0) for goal in reversed(roots)]
        while stack:
            goal, depth = stack.pop()
            outcome = "" if goal.outcome == "UNKNOWN" else f" {goal.outcome}"
            error = f" ({goal.error})" if goal.error else ""
            yield f"{'  ' * depth}{goal.goal} {goal.goal_class} {goal.mode}{outcome}{error}"
            stack += [(child, depth + 1) for child in reversed(children.get(goal.goal, []))]
