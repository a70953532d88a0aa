"""The interface of planners: from domain and problem to a plan, a sequence of actions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from math import inf
from pathlib import Path
from typing import Final

from cxbridge.executive.pddl.ast import Domain, Problem
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.errors import UnsupportedProblemError
from cxbridge_planning.needs import Need

DEFAULT_RANK: Final = 10
"""The rank of pyperplan, and of planners without a measured rank."""


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
    :param message: why there is no plan; empty if there is a plan.
    :param seconds: the duration of the call in seconds.
    :param why: why this planner has made the result, e.g. the planners that are unsuitable or have failed.
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
    """Sets of features that the planner supports singly but not together."""

    proves: bool = True
    """Whether a search without result proves that no plan exists."""

    time_limit_s: float = inf
    """The time limit of :meth:`solve`, until which some planners improve their plans."""

    @property
    def unavailable_reason(self) -> str:
        """Why the planner is unavailable on this machine, with the remedy; empty for an available planner."""
        return ""

    def rank(self, needs: Collection[Need]) -> int:  # noqa: ARG002 - for subclasses
        """Return the planner's place in the order of ``auto`` for a problem with such needs, lowest first."""
        return DEFAULT_RANK

    def refusal_reason(self, needs: Mapping[Need, str]) -> str:
        """Return why the planner refuses a problem with these features; empty if the planner accepts it.

        :param needs: the features, each with its first user, e.g. ``action pick``.
        """
        for need, user in needs.items():
            if need not in self.understands | self.ignores:
                return f"{self.name} does not support {need.value} ({user})"
        for combination in self.fails_with:
            if combination <= needs.keys():
                needs_text = " with ".join(sorted(need.value for need in combination))
                return f"{self.name} does not support {needs_text}"
        return ""

    def check(self, needs: Mapping[Need, str]) -> None:
        """Check that the planner is installed and supports these features.

        :raises UnsupportedProblemError: with the reason if it does not.
        """
        reason = self.unavailable_reason or self.refusal_reason(needs)
        if reason:
            raise UnsupportedProblemError(reason)

    def best_so_far(
        self,
        folder: Path,  # noqa: ARG002 - for planners that look for better plans
        domain: Domain,  # noqa: ARG002 - as above
        problem: Problem,  # noqa: ARG002 - as above
    ) -> tuple[PlannedAction, ...] | None:
        """Return the best plan that the planner's process saved before its time limit; None without one.

        :param folder: the temporary files of the ended process.
        """
        return None

    @abstractmethod
    def solve(self, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return a plan; None if the planner finds that there is none.

        :raises PlanningError: if the planner fails.
        """
