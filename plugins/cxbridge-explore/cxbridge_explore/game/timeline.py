"""What robots and machines did when, in a game."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace


@dataclass(frozen=True, slots=True)
class Span:
    """An interval: a skill, or a state of a machine.

    :param begin: seconds of the production; before it they are negative.
    :param text: the skill, or the state.
    :param status: how the skill ended, as :mod:`cxbridge.history.model` calls it; empty for a state.
    :param error: why it has failed.
    """

    begin: float
    end: float
    text: str
    status: str = ""
    error: str = ""


@dataclass(frozen=True, slots=True)
class Timeline:
    """What robots and machines did in the production.

    :param seconds: how long it was.
    :param skills: by robot, in order; with the time before the production.
    :param machines: the states of each machine in the production, in order.
    """

    seconds: float = 0.0
    skills: Mapping[str, tuple[Span, ...]] = field(default_factory=dict)
    machines: Mapping[str, tuple[Span, ...]] = field(default_factory=dict)

    @property
    def machine_use(self) -> dict[str, dict[str, float]]:
        """How many seconds each machine was in each state, the longest first."""
        found: dict[str, dict[str, float]] = {}
        for name, spans in self.machines.items():
            seconds: dict[str, float] = {}
            for span in spans:
                seconds[span.text] = seconds.get(span.text, 0.0) + span.end - span.begin
            ordered = sorted(seconds.items(), key=lambda item: -item[1])
            found[name] = {state: round(value, 1) for state, value in ordered}
        return found

    def idle_seconds(self, robot: str) -> float:
        """Return how long a robot has executed no skill."""
        return self.seconds - covered(within(self.skills.get(robot, ()), self.seconds))


def within(spans: Iterable[Span], seconds: float) -> Iterator[Span]:
    """Yield what of the spans is within the production."""
    for span in spans:
        begin, end = max(0.0, span.begin), min(seconds, span.end)
        if begin < end:
            yield replace(span, begin=begin, end=end)


def covered(spans: Iterable[Span]) -> float:
    """Return how many seconds there is at least one of the spans."""
    total, reached = 0.0, float("-inf")
    for span in sorted(spans, key=lambda span: span.begin):
        total += max(0.0, span.end - max(span.begin, reached))
        reached = max(reached, span.end)
    return total
