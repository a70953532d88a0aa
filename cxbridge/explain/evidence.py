"""What is known of a run at one moment, wherever it came from: a scenario, a recording, a daemon."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, GoalTransition, Level, LogLine, PlanActionTransition, RuleFired, SkillStatus
from cxbridge.explain.snapshot import Rulebook, Snapshot

STORY_TYPES: Final = (GoalTransition, PlanActionTransition, SkillStatus, RuleFired, LogLine)
"""The events that tell how goals came about."""

MOST_FIRINGS: Final = 200_000
"""Firings that are remembered, the last ones."""

MOST_LINES: Final = 2000
"""Warnings and errors that are remembered."""


@dataclass(slots=True)
class History:
    """What happened up to the moment: transitions, firings, warnings. A sink for an event bus.

    :param env: the environment it is about.
    :ivar rules_known: whether firings were told at all.
    """

    env: str
    transitions: list[GoalTransition | PlanActionTransition | SkillStatus] = field(default_factory=list)
    firings: deque[RuleFired] = field(default_factory=lambda: deque(maxlen=MOST_FIRINGS))
    warnings: deque[LogLine] = field(default_factory=lambda: deque(maxlen=MOST_LINES))
    rules_known: bool = False

    def take(self, event: Event) -> None:
        """Remember an event, if it tells how goals came about."""
        if isinstance(event, LogLine):
            if event.level in (Level.WARN, Level.ERROR):
                self.warnings.append(event)
        elif isinstance(event, (GoalTransition, PlanActionTransition, SkillStatus)):
            if event.env == self.env:
                self.transitions.append(event)
        elif isinstance(event, RuleFired) and event.env == self.env:
            self.rules_known = True
            self.firings.append(event)


class Evidence(ABC):
    """What is known.

    :param where: what it is of, and when, for people: ``test-scenario at 3.0 s``.
    :param start_us: when the run began.
    :param now_us: the moment.
    :param history: what happened before it; None when nobody took notice.
    """

    def __init__(self, where: str, start_us: int, now_us: int, history: History | None) -> None:
        self.where = where
        self.start_us = start_us
        self.now_us = now_us
        self.history = history
        self.notes: list[str] = []

    @abstractmethod
    def rulebook(self) -> Rulebook:
        """Return which rules there are.

        :raises CxbridgeError: when that is not known, with what to do about it.
        """

    @abstractmethod
    def snapshot(self, rule: str) -> Snapshot:
        """Return what there is to know of a rule.

        :raises CxbridgeError: when there is no such rule, or facts are not known.
        """

    def seconds(self, time_us: int) -> float:
        """Return a time as seconds since the begin of the run."""
        return (time_us - self.start_us) / MICROSECONDS

    def firings(self, rule: str) -> Sequence[RuleFired] | None:
        """Return the firings of a rule before the moment; None when firings are not known."""
        if self.history is None or not self.history.rules_known:
            return None
        return [event for event in self.history.firings if event.rule == rule]
