"""The context of a difference: the events before it, the rules that fired, the goals at that point."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from cxbridge.clock import MICROSECONDS
from cxbridge.event_kinds import View
from cxbridge.events import Event, GoalTransition, RuleFired
from cxbridge.history.forest import Forest, parent_id
from cxbridge.trace.compare.model import DifferenceContext, EventLine, GoalAtDifference
from cxbridge.trace.compare.selection import Selection, with_kept
from cxbridge.trace.formats.base import Run
from cxbridge.trace.listing import describe

LINES_BEFORE = 6
"""How many events are shown before the one at the difference."""

LINES_AFTER = 2
"""How many are shown after it."""

RULES_BEFORE = 5
"""How many firings before it are shown."""

TIDY_AT = 1000
"""With so many goals those that are gone are forgotten, and again whenever there are twice as many."""


class ContextTracker:
    """Keeps the context of the last event of a run."""

    def __init__(self) -> None:
        self._events: deque[tuple[int, Event]] = deque(maxlen=LINES_BEFORE + 1)
        self._rules: deque[RuleFired] = deque(maxlen=RULES_BEFORE)
        self._goals: dict[str, GoalTransition] = {}
        self._tidy_at = TIDY_AT
        self._start_us: int | None = None
        self._after: list[EventLine] | None = None
        self._missing = 0

    def add(self, event: Event, number: int | None) -> None:
        """Take the next event.

        :param number: its number among those that are compared, from 0; None: it is none of them.
        """
        if self._start_us is None:
            self._start_us = event.time_us
        if number is not None:
            self._events.append((number, event))
            self._follow(number, event)
        if type(event) is GoalTransition:
            self._goals[event.goal] = event
            if len(self._goals) > self._tidy_at:
                self._tidy()
        elif type(event) is RuleFired:
            self._rules.append(event)

    def context(self, position: int | None) -> DifferenceContext:
        """Return what led to the event that came last; the events after it are added as they come.

        :param position: the number of the event at the difference, from 0.
        """
        lines = [self.line(number, event, here=number == position) for number, event in self._events]
        self._after, self._missing = lines, LINES_AFTER
        return DifferenceContext(
            lines, [describe(rule) for rule in self._rules], list(goal_lines(self._goals))
        )

    def line(self, number: int, event: Event, *, here: bool = False) -> EventLine:
        """Return an event of the run as a line."""
        seconds = (event.time_us - (self._start_us or 0)) / MICROSECONDS
        return EventLine(number + 1, seconds, describe(event), here)

    @property
    def settled(self) -> bool:
        """Whether the lines after the context are there."""
        return self._after is None

    def _follow(self, number: int, event: Event) -> None:
        """Add an event to the context that was asked for."""
        if self._after is not None:
            self._after.append(self.line(number, event))
            self._missing -= 1
            if not self._missing:
                self._after = None

    def _tidy(self) -> None:
        """Forget the goals that no tree shows any more."""
        shown = {line.goal for line in goal_lines(self._goals)}
        self._goals = {name: goal for name, goal in self._goals.items() if name in shown}
        self._tidy_at = max(TIDY_AT, 2 * len(self._goals))


def goal_lines(goals: dict[str, GoalTransition]) -> Iterator[GoalAtDifference]:
    """Yield goals as a tree; retracted roots, and what is below them, are left out.

    :param goals: the last transition of each goal.
    """
    forest = Forest({name: parent_id(goal.parent) for name, goal in goals.items()})
    for name, depth in forest.walk(name for name in forest.roots if goals[name].mode != "RETRACTED"):
        goal = goals[name]
        yield GoalAtDifference(depth, goal.goal, goal.goal_class, goal.mode, goal.outcome, goal.error)


def context_of(
    run: Run, view: View, position: int | None, selection: Selection | None = None
) -> DifferenceContext:
    """Read a run up to an event, and return what led to it.

    :param position: the event's number among those that are compared, from 0; None: nothing is found.
    """
    tracker = ContextTracker()
    found: DifferenceContext | None = None
    number = 0
    for event, kept in with_kept(run, view, selection) if position is not None else ():
        tracker.add(event, None if kept is None else number)
        if kept is None:
            continue
        if number == position:
            found = tracker.context(position)
        elif found is not None and tracker.settled:
            break
        number += 1
    return found or DifferenceContext()
