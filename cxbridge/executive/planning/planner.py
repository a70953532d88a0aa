"""The interface of planners: a domain and a problem in, a sequence of actions or none out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from math import inf
from pathlib import Path
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import Domain, Problem
from cxbridge.executive.planning.errors import UnsupportedProblemError
from cxbridge.executive.planning.needs import Need

_DECIMALS: Final = 3

RANK: Final = 10
"""The rank of pyperplan, and of planners that say nothing about theirs."""


class PlannedAction(NamedTuple):
    """A step of a plan.

    :param start: when it starts, in seconds after the plan's start; None in a plan that is just an order.
    :param duration: how long it takes, in seconds; None when that is not planned.
    """

    name: str
    arguments: tuple[str, ...] = ()
    start: float | None = None
    duration: float | None = None

    def __str__(self) -> str:
        """Return the step as plans in files have it."""
        text = f"({' '.join((self.name, *self.arguments))})"
        if self.start is not None:
            text = f"{_seconds(self.start)}: {text}"
        return text if self.duration is None else f"{text} [{_seconds(self.duration)}]"


def _seconds(value: float) -> str:
    """Return a time with three decimals, or as many as it needs: rounded, moments may change places."""
    text = f"{value:.9f}".rstrip("0")
    return text if len(text.partition(".")[2]) > _DECIMALS else f"{value:.3f}"


class PlanStatus(Enum):
    """How planning ended."""

    PLANNED = "PLANNED"
    NO_PLAN = "NO-PLAN"
    """There is none, as far as the planner can tell."""
    FAILED = "FAILED"
    """The planner refused the problem, crashed, or made no sense."""
    TIMEOUT = "TIMEOUT"
    CANCELLED = "CANCELLED"


@dataclass(frozen=True, slots=True)
class PlanResult:
    """The result of a call of a planner.

    :param planner: its name.
    :param actions: the plan; empty when there is none, or nothing needs to be done.
    :param message: why there is no plan; empty when there is one.
    :param seconds: how long it took.
    :param why: why this planner was chosen: which planners did not fit or failed before.
    """

    status: PlanStatus
    planner: str
    actions: tuple[PlannedAction, ...] = ()
    message: str = ""
    seconds: float = 0.0
    why: str = ""


class Planner(ABC):
    """A planner.

    Subclass it, name it, declare its requirements, and implement :meth:`solve`. It runs in a child process,
    where it may take its time, print and crash.
    """

    name: str
    understands: frozenset[Need]
    ignores: frozenset[Need] = frozenset()
    """The parts that the planner takes and leaves out: its plan holds, and another one may be better."""

    fails_with: tuple[frozenset[Need], ...] = ()
    """Needs that the planner has each, and not together: measured, docs/planning.md."""

    proves: bool = True
    """Whether there is no plan when the planner finds none."""

    seconds: float = inf
    """How long the planner may take; one that looks for better plans ends before."""

    @property
    def not_installed(self) -> str:
        """Why the planner cannot be used on this machine; empty when it can."""
        return ""

    def rank(self, needs: Collection[Need]) -> int:  # noqa: ARG002 - for subclasses
        """Return the place among the planners that ``auto`` tries for such a problem: the lowest first."""
        return RANK

    def refuses(self, needs: Mapping[Need, str]) -> str:
        """Return why the planner cannot take a problem with these needs; empty when it can."""
        for need, where in needs.items():
            if need not in self.understands | self.ignores:
                return f"{self.name} knows nothing of {need.value} ({where})"
        for together in self.fails_with:
            if together <= needs.keys():
                texts = " with ".join(sorted(need.value for need in together))
                return f"{self.name} cannot take {texts}"
        return ""

    def check(self, needs: Mapping[Need, str]) -> None:
        """Check that the planner can be used for a problem with these needs.

        :raises UnsupportedProblemError: with the reason when it cannot.
        """
        reason = self.not_installed or self.refuses(needs)
        if reason:
            raise UnsupportedProblemError(reason)

    def best_so_far(
        self,
        folder: Path,  # noqa: ARG002 - for planners that look for better plans
        domain: Domain,  # noqa: ARG002
        problem: Problem,  # noqa: ARG002
    ) -> tuple[PlannedAction, ...] | None:
        """Return the best plan that the planner's process left behind when its time was over.

        :param folder: the temporary files of the process, which is gone.
        """
        return None

    @abstractmethod
    def solve(self, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return a plan; None when there is none.

        :raises PlanningError: when the planner fails.
        """
