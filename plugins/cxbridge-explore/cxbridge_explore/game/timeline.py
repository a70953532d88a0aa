"""The timeline of a game: intervals of robots and machines."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace


@dataclass(frozen=True, slots=True)
class Span:
    """The interval of a skill, or of a state of a machine.

    :param begin: the start in seconds since the start of the production; negative before the production.
    :param end: the end in seconds since the start of the production.
    :param text: the skill or the state.
    :param status: the status of the skill as in :mod:`cxbridge.history.model`; empty for a state.
    :param error: the error of a failed skill.
    """

    begin: float
    end: float
    text: str
    status: str = ""
    error: str = ""


@dataclass(frozen=True, slots=True)
class Timeline:
    """The intervals of robots and machines.

    :param seconds: the duration of the production.
    :param skills: the skills of each robot in order, including the time before the production.
    :param machines: the states of each machine in order, during the production.
    """

    seconds: float = 0.0
    skills: Mapping[str, tuple[Span, ...]] = field(default_factory=dict)
    machines: Mapping[str, tuple[Span, ...]] = field(default_factory=dict)

    @property
    def machine_use(self) -> dict[str, dict[str, float]]:
        """The seconds that each machine was in each state, the longest first."""
        seconds_by_state: dict[str, dict[str, float]] = {}
        for name, spans in self.machines.items():
            seconds: dict[str, float] = {}
            for span in spans:
                seconds[span.text] = seconds.get(span.text, 0.0) + span.end - span.begin
            ordered = sorted(seconds.items(), key=lambda item: -item[1])
            seconds_by_state[name] = {state: round(value, 1) for state, value in ordered}
        return seconds_by_state

    def idle_seconds(self, robot: str) -> float:
        """Return the time without skills during the production."""
        return self.seconds - covered_seconds(clip_spans(self.skills.get(robot, ()), self.seconds))


def clip_spans(spans: Iterable[Span], seconds: float) -> Iterator[Span]:
    """Yield the parts of the intervals within the production."""
    for span in spans:
        begin, end = max(0.0, span.begin), min(seconds, span.end)
        if begin < end:
            yield replace(span, begin=begin, end=end)


def covered_seconds(spans: Iterable[Span]) -> float:
    """Return the length of the union of intervals, which may overlap: a robot may have several executors."""
    total, covered_until = 0.0, float("-inf")
    for span in sorted(spans, key=lambda span: span.begin):
        total += max(0.0, span.end - max(span.begin, covered_until))
        covered_until = max(covered_until, span.end)
    return total
