"""Deciders of a simulated skill's end.

The first decider with an answer decides. The next decider completes an answer without a duration: a failure
gets a duration, and a success becomes the next outcome, but keeps its own effect.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.skiller.skillstring import SkillStringCall

Effect = Callable[[], object]
"""The change of the world at the end of a skill."""


FOREVER_S = 1e9
"""The duration of a skill that never ends, in seconds (30 years)."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of a skill.

    :param seconds: the duration; None: the next decider or the executor chooses the duration.
    :param error: the reason of a failure.
    :param share: the part of the duration that a failing skill takes, from 0 to 1.
    :param then: changes the world at the end; None: nothing changes.
    """

    seconds: float | None = None
    status: Status = Status.S_FINAL
    error: str = ""
    share: float = 1.0
    then: Effect | None = field(default=None, compare=False)

    @property
    def is_failure(self) -> bool:
        """Whether the skill fails."""
        return self.status is not Status.S_FINAL

    def complete_with(self, usual_outcome: Outcome) -> Outcome:
        """Return this failure with its share of the usual duration; for a success, return the usual outcome.

        An effect of this outcome replaces the effect of the usual outcome.
        """
        # with known seconds the share is applied here, so the result has the share 1
        seconds = None if usual_outcome.seconds is None else usual_outcome.seconds * self.share
        then = self.then or usual_outcome.then
        if not self.is_failure:
            return replace(usual_outcome, then=then)
        return replace(self, seconds=seconds, share=self.share if seconds is None else 1.0, then=then)


class Decider(ABC):
    """Decides how skills end.

    :param priority: deciders with higher priority decide first.
    """

    priority: int = 0

    @abstractmethod
    def decide(self, call: SkillStringCall) -> Outcome | None:
        """Return how a starting skill will end; None if undecided."""


def decide_outcome(deciders: Iterable[Decider], call: SkillStringCall) -> Outcome | None:
    """Return how a starting call will end; None if no decider knows."""
    # an outcome without duration, e.g. an injected failure, needs the duration of the next decider
    decision: Outcome | None = None
    for decider in sorted(deciders, key=lambda decider: -decider.priority):
        outcome = decider.decide(call)
        if outcome is None:
            continue
        decision = outcome if decision is None else decision.complete_with(outcome)
        if decision.seconds is not None:
            break
    return decision
