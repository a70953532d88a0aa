"""The embedded planner: pyperplan's searches and heuristics on cxbridge's grounding (:mod:`.grounding`)."""

from __future__ import annotations

import logging
from typing import Final

from cxbridge.executive.pddl.ast import Domain, Problem
from cxbridge.executive.planning.compile.grounding import ground
from cxbridge.executive.planning.compile.strips import Operator, StripsTask
from cxbridge.executive.planning.errors import UnknownPlannerError
from cxbridge.executive.planning.needs import CLASSICAL, Need
from cxbridge.executive.planning.planner import PlannedAction, Planner

SEARCHES: Final = ("gbf", "astar", "wastar", "ehs", "bfs", "ids")
"""Greedy best first, A*, weighted A*, enforced hill climbing, breadth first, iterative deepening."""

HEURISTICS: Final = ("hff", "hadd", "hmax", "hsa", "blind", "lmcut", "landmark")

_UNINFORMED: Final = frozenset({"bfs", "ids"})


class PyperplanPlanner(Planner):
    """Pyperplan without action costs. ``astar`` with an admissible heuristic minimises the number of actions.

    :param search: one of :data:`SEARCHES`.
    :param heuristic: one of :data:`HEURISTICS`.
    :raises UnknownPlannerError: if an option is unknown.
    """

    name = "pyperplan"
    understands = CLASSICAL
    ignores = frozenset({Need.COSTS, Need.COUNTERS})

    def __init__(self, search: str = "gbf", heuristic: str = "hff") -> None:
        for option, value, known in (("search", search, SEARCHES), ("heuristic", heuristic, HEURISTICS)):
            if value not in known:
                raise UnknownPlannerError(
                    f"pyperplan has no {option} '{value}'", hint=f"take one of {', '.join(known)}"
                )
        self.search = search
        self.heuristic = heuristic

    def solve(self, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return a plan; None if the reachable states are exhausted."""
        strips = ground(domain, problem)
        if strips.goal <= strips.initial:
            return ()
        found = self._search(strips)
        if found is None:
            return None
        return tuple(PlannedAction(*operator.action) for operator in found if operator.action is not None)

    def _search(self, strips: StripsTask) -> list[Operator] | None:
        # imported only in the planner's process
        from pyperplan import planner as pyperplan  # noqa: PLC0415
        from pyperplan.task import Operator as PyOperator  # noqa: PLC0415
        from pyperplan.task import Task  # noqa: PLC0415

        logging.getLogger().setLevel(logging.WARNING)
        # numbers are fast and reproducibly ordered, but lmcut prints facts as texts
        facts = [str(fact) if self.heuristic == "lmcut" else fact for fact in range(len(strips.facts))]

        def named(numbers: frozenset[int]) -> frozenset[int | str]:
            return frozenset(facts[number] for number in numbers)

        operators = [
            PyOperator(str(number), named(each.preconditions), named(each.adds), named(each.deletes))
            for number, each in enumerate(strips.operators)
        ]
        task = Task("task", set(facts), named(strips.initial), named(strips.goal), operators)
        search = pyperplan.SEARCHES[self.search]
        if self.search in _UNINFORMED:
            found = search(task)
        else:
            found = search(task, pyperplan.HEURISTICS[self.heuristic](task))
        return None if found is None else [strips.operators[int(step.name)] for step in found]
