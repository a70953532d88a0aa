"""What led to an event: the events before it, the rules that fired, the goals at that point."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, GoalTransition, RuleFired
from cxbridge.history.forest import Forest, parent_id
from cxbridge.trace.compare.naming import describe

LINES_BEFORE = 6
"""How many events are shown before the one at the difference."""

LINES_AFTER = 2
"""How many are shown after it."""

RULES_BEFORE = 5
"""How many firings before it are shown."""

TIDY_AT = 1000
"""With so many goals those that are gone are forgotten, and again whenever there are twice as many."""


@dataclass(frozen=True, slots=True)
class Line:
    """An event that is shown.

    :param number: its number among those that are compared, from 1.
    :param seconds: time since the first event of the run.
    :param here: whether it is the one at the difference.
    """

    number: int
    seconds: float
    text: str
    here: bool


@dataclass(frozen=True, slots=True)
class GoalLine:
    """A goal as it is at the difference.

    :param depth: how many goals are above it.
    """

    depth: int
    goal: str
    goal_class: str
    mode: str
    outcome: str
    error: str

    @property
    def text(self) -> str:
        """The goal on one line, indented."""
        outcome = "" if self.outcome == "UNKNOWN" else f" {self.outcome}"
        error = f" ({self.error})" if self.error else ""
        return f"{'  ' * self.depth}{self.goal} {self.goal_class} {self.mode}{outcome}{error}"


@dataclass(frozen=True, slots=True)
class Context:
    """What led to a difference on one side.

    :param lines: the events around it.
    :param rules: the firings just before it, when the run has firings.
    :param goals: the goals that are not retracted at that point, parents before their children.
    """

    lines: list[Line] = field(default_factory=list)
    rules: list[str] = field(default_factory=list)
    goals: list[GoalLine] = field(default_factory=list)


class Trail:
    """Remembers what led to the event of a run that came last."""

    def __init__(self) -> None:
        self._events: deque[tuple[int, Event]] = deque(maxlen=LINES_BEFORE + 1)
        self._rules: deque[RuleFired] = deque(maxlen=RULES_BEFORE)
        self._goals: dict[str, GoalTransition] = {}
        self._tidy_at = TIDY_AT
        self._start_us: int | None = None
        self._after: list[Line] | None = None
        self._missing = 0

    def take(self, event: Event, number: int | None) -> None:
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

    def context(self, position: int | None) -> Context:
        """Return what led to the event that came last; the events after it are added as they come.

        :param position: the number of the event at the difference, from 0.
        """
        lines = [self.line(number, event, here=number == position) for number, event in self._events]
        self._after, self._missing = lines, LINES_AFTER
        return Context(lines, [describe(rule) for rule in self._rules], list(goal_lines(self._goals)))

    def line(self, number: int, event: Event, *, here: bool = False) -> Line:
        """Return an event of the run as a line."""
        seconds = (event.time_us - (self._start_us or 0)) / MICROSECONDS
        return Line(number + 1, seconds, describe(event), here)

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


def goal_lines(goals: dict[str, GoalTransition]) -> Iterator[GoalLine]:
    """Yield goals as a tree; retracted roots, and what is below them, are left out.

    :param goals: the last transition of each goal.
    """
    forest = Forest({name: parent_id(goal.parent) for name, goal in goals.items()})
    for name, depth in forest.walk(name for name in forest.roots if goals[name].mode != "RETRACTED"):
        goal = goals[name]
        yield GoalLine(depth, goal.goal, goal.goal_class, goal.mode, goal.outcome, goal.error)
