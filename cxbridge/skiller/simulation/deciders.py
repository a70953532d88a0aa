"""Deciders: how a simulated skill ends, asked one after the other until one of them knows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.skiller.skillstring import SkillStringCall

Effect = Callable[[], object]
"""The change of the world at the end of a skill."""


FOREVER = 1e9
"""Seconds that a skill which does not end by itself would take: three decades."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a skill ends.

    :param seconds: how long it takes; None: as long as the next decider says, or the executor takes.
    :param share: of this duration, from 0 to 1, the part that the skill takes.
    :param then: called when the skill ends in this way.
    """

    seconds: float | None = None
    status: Status = Status.S_FINAL
    error: str = ""
    share: float = 1.0
    then: Effect | None = field(default=None, compare=False)

    @property
    def failed(self) -> bool:
        """Whether the skill fails."""
        return self.status is not Status.S_FINAL

    def after(self, usual: Outcome) -> Outcome:
        """Return this outcome with the duration of another; a success becomes the other outcome."""
        seconds = None if usual.seconds is None else usual.seconds * self.share
        then = self.then or usual.then
        if not self.failed:
            return replace(usual, then=then)
        return replace(self, seconds=seconds, share=self.share if seconds is None else 1.0, then=then)


class Decider(ABC):
    """Decides how skills end.

    :param priority: the one with the highest is asked first.
    """

    priority: int = 0

    @abstractmethod
    def decide(self, call: SkillStringCall) -> Outcome | None:
        """Return how the skill ends; None when this decider cannot tell. Called when the skill begins."""

    def progress(self, call: SkillStringCall, seconds: float) -> None:  # noqa: B027 - most have nothing to do
        """Change the world while a skill runs, in every loop; for skills whose duration is this decider's.

        :param seconds: since it began; at its end its duration.
        """

    def close(self) -> None:  # noqa: B027 - most have nothing to close
        """Let go of everything."""


class Decision(NamedTuple):
    """How a skill ends, and the decider that has said how long it takes."""

    decider: Decider
    outcome: Outcome


class Deciders:
    """The deciders of a Skiller, or of an agent on the skill board: the first that knows a duration counts.

    :param deciders: asked in order of descending priority. Closed with the chain.
    """

    def __init__(self, deciders: Iterable[Decider]) -> None:
        self._deciders = sorted(deciders, key=lambda decider: -decider.priority)

    def decide(self, call: SkillStringCall) -> Decision | None:
        """Return how a call ends that begins; None when no decider knows.

        A decider that knows no duration, e.g. of a failure on purpose, is followed by the next one.
        """
        found: Decision | None = None
        for decider in self._deciders:
            outcome = decider.decide(call)
            if outcome is None:
                continue
            found = Decision(decider, outcome if found is None else found.outcome.after(outcome))
            if found.outcome.seconds is not None:
                break
        return found

    def close(self) -> None:
        """Close the deciders."""
        for decider in self._deciders:
            decider.close()
