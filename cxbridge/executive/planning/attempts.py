"""The planners that try a problem one after the other: the time of each, and their results."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from cxbridge.executive.planning.planner import Planner, PlanResult, PlanStatus
from cxbridge.executive.planning.registry import AUTO, Choice, more_planners

# How much of the time that is left a planner may take that is not the last one.
_SHARE: Final = 0.6


class Attempts:
    """The results of a call's planners so far.

    :param asked: the planner that was asked for.
    """

    def __init__(self, asked: str) -> None:
        self._asked = asked
        self._choice = Choice((), ())
        self._results: list[PlanResult] = []

    def begin(self, choice: Choice) -> None:
        """Note who may try."""
        self._choice = choice

    def shares(self) -> Iterator[tuple[Planner, float]]:
        """Yield the planners in order, each with its share of the time that is left then."""
        planners = self._choice.planners
        for planner in planners[:-1]:
            yield planner, _SHARE
        yield planners[-1], 1.0

    def is_last_word(self, planner: Planner, result: PlanResult) -> bool:
        """Note a result; whether it ends the call."""
        self._results.append(result)
        proved = result.status is PlanStatus.NO_PLAN and planner.proves
        return result.status is PlanStatus.PLANNED or proved or self._asked != AUTO

    def explained(self, result: PlanResult) -> PlanResult:
        """Return the result that counts, with the reasons why its planner came to be taken."""
        if self._asked != AUTO:
            return result
        before = [each.message for each in self._results[:-1] if each.message]
        reasons = (result.why, *self._choice.reasons, *before)
        return replace(result, why="; ".join(filter(None, reasons)))

    def summary(self) -> PlanResult:
        """Return the result when no planner had the last word."""
        messages = "; ".join(each.message for each in self._results)
        # planners without a plan prove nothing when other planners have failed
        for status in (PlanStatus.TIMEOUT, PlanStatus.FAILED, PlanStatus.NO_PLAN):
            for result in self._results:
                if result.status is status:
                    return self.explained(replace(result, message=messages))
        return self._results[-1]

    @property
    def advice(self) -> str:
        """What could be tried after a time-out, as the rest of a sentence."""
        fitting = [planner.name for planner in self._choice.planners]
        tried = [each.planner for each in self._results] or fitting[:1]
        said = f" (tried: {', '.join((*tried, *fitting[len(tried) : len(tried) + 1]))})" if fitting else ""
        absent = self._choice.absent
        more = f", or install one of {', '.join(absent)}" if absent else ""
        if command := more_planners():
            more = f", or install more planners: {command}"
        if self._asked != AUTO:
            more = f", or try the planner {AUTO}"
        return f"{said}: give more time{more}"
