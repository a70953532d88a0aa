"""The interface of planners: from domain and problem to a plan, a sequence of actions.

A plan has two notations: the notation of plan files, with few decimals (``str`` of an action), and the
notation of recordings, with exact times (:func:`plan_text`).
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from math import inf
from pathlib import Path
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import Domain, Problem
from cxbridge.executive.planning.errors import UnsupportedProblemError
from cxbridge.executive.planning.needs import Need

_DECIMALS: Final = 3  # of times in plan files
# START: (NAME ARGUMENT...) [DURATION]; possessive quantifiers bound the time for any text
_ACTION_PATTERN: Final = re.compile(
    r"\s*+(?:([^\s():]++)\s*+:)?\s*+\(\s*+([^\s()]++)([^()]*+)\)\s*+(?:\[\s*+([^\s\]]++)\s*+\]\s*+\)?\s*+)?"
)

DEFAULT_RANK: Final = 10
"""The rank of pyperplan, and of planners without a measured rank."""


class PlannedAction(NamedTuple):
    """A step of a plan.

    :param start: the start in seconds after the plan's start; None in an untimed plan.
    :param duration: the planned duration in seconds; None for an action without duration.
    """

    name: str
    arguments: tuple[str, ...] = ()
    start: float | None = None
    duration: float | None = None

    def __str__(self) -> str:
        """Return the step in the notation of plan files."""
        text = f"({' '.join((self.name, *self.arguments))})"
        if self.start is not None:
            text = f"{_format_seconds(self.start)}: {text}"
        return text if self.duration is None else f"{text} [{_format_seconds(self.duration)}]"


def _format_seconds(value: float) -> str:
    """Return a time with the three decimals of plan files, or more decimals if the time has more."""
    # rounding could swap the order of two times
    text = f"{value:.9f}".rstrip("0")
    return text if len(text.partition(".")[2]) > _DECIMALS else f"{value:.3f}"


def plan_text(actions: Iterable[PlannedAction]) -> str:
    """Return a plan with a line ``START: (NAME ARGUMENT...) [DURATION]`` for each action.

    An action without times has only the brackets.
    """
    return "\n".join(map(_format_action, actions))


def parse_plan_text(text: str) -> tuple[PlannedAction, ...]:
    """Parse a plan from :func:`plan_text`.

    :raises ValueError: if a line is not an action.
    """
    return tuple(map(_parse_action, text.splitlines()))


def _format_action(action: PlannedAction) -> str:
    # repr() of a float parses to exactly the same float
    start = "" if action.start is None else f"{action.start!r}: "
    duration = "" if action.duration is None else f" [{action.duration!r}]"
    return f"{start}({' '.join((action.name, *action.arguments))}){duration}"


def _parse_action(line: str) -> PlannedAction:
    match = _ACTION_PATTERN.fullmatch(line)
    if match is None:
        raise ValueError(f"not an action of a plan: {line!r}")
    start, name, arguments, duration = match.groups()
    return PlannedAction(
        name,
        tuple(arguments.split()),
        None if start is None else float(start),
        None if duration is None else float(duration),
    )


class PlanStatus(Enum):
    """The outcome of planning."""

    PLANNED = "PLANNED"
    NO_PLAN = "NO-PLAN"
    """The planner found that no plan exists."""
    FAILED = "FAILED"
    """The planner refused the problem, crashed, or returned an invalid plan."""
    TIMEOUT = "TIMEOUT"
    CANCELLED = "CANCELLED"


@dataclass(frozen=True, slots=True)
class PlanResult:
    """The result of a planner call.

    :param actions: the plan; empty if there is no plan, or if the goal holds already.
    :param message: why there is no plan; else empty.
    :param seconds: the duration of the call.
    :param why: why this planner was chosen, e.g. the planners that are unsuitable or have failed.
    """

    status: PlanStatus
    planner: str
    actions: tuple[PlannedAction, ...] = ()
    message: str = ""
    seconds: float = 0.0
    why: str = ""


class Planner(ABC):
    """The base class of planners.

    A subclass has a name and supported features, and implements :meth:`solve`, which runs in a child process
    and may block, print and crash.
    """

    name: str
    understands: frozenset[Need]
    ignores: frozenset[Need] = frozenset()
    """Features that the planner accepts and ignores: its plans are valid, but perhaps not the best."""

    fails_with: tuple[frozenset[Need], ...] = ()
    """Sets of features that the planner supports singly but not together, measured in docs/planning.md."""

    proves: bool = True
    """Whether a search without result proves that no plan exists."""

    seconds: float = inf
    """The time limit, for planners that improve their plans until then."""

    @property
    def not_installed(self) -> str:
        """Why the planner is unavailable on this machine; else empty."""
        return ""

    def rank(self, needs: Collection[Need]) -> int:  # noqa: ARG002 - for subclasses
        """Return the planner's place in the order of ``auto`` for a problem with such needs, lowest first."""
        return DEFAULT_RANK

    def refusal_reason(self, needs: Mapping[Need, str]) -> str:
        """Return why the planner refuses a problem with these features; empty if it accepts."""
        for need, where in needs.items():
            if need not in self.understands | self.ignores:
                return f"{self.name} does not support {need.value} ({where})"
        for combination in self.fails_with:
            if combination <= needs.keys():
                texts = " with ".join(sorted(need.value for need in combination))
                return f"{self.name} does not support {texts}"
        return ""

    def check(self, needs: Mapping[Need, str]) -> None:
        """Check that the planner is installed and supports these features.

        :raises UnsupportedProblemError: with the reason if it does not.
        """
        reason = self.not_installed or self.refusal_reason(needs)
        if reason:
            raise UnsupportedProblemError(reason)

    def best_so_far(
        self,
        folder: Path,  # noqa: ARG002 - for planners that look for better plans
        domain: Domain,  # noqa: ARG002
        problem: Problem,  # noqa: ARG002
    ) -> tuple[PlannedAction, ...] | None:
        """Return the best plan that the planner's process saved before its time limit.

        :param folder: the temporary files of the ended process.
        """
        return None

    @abstractmethod
    def solve(self, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return a plan; None if there is none.

        :raises PlanningError: if the planner fails.
        """
