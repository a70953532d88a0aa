"""The embedded planner: pyperplan's searches and heuristics on a task that cxbridge has grounded.

pyperplan's own parser and grounding support plain STRIPS only; :mod:`.compile.grounding` supports more of
PDDL.
"""

from __future__ import annotations

import logging
from typing import Final

from cxbridge.executive.pddl.ast import Domain, Problem
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.compile.grounding import ground
from cxbridge_planning.compile.strips import Operator, StripsTask
from cxbridge_planning.errors import UnknownPlannerError
from cxbridge_planning.needs import CLASSICAL, Need
from cxbridge_planning.planner import Planner

SEARCHES: Final = ("gbf", "astar", "wastar", "ehs", "bfs", "ids")
"""Greedy best first, A*, weighted A*, enforced hill climbing, breadth first, iterative deepening."""

HEURISTICS: Final = ("hff", "hadd", "hmax", "hsa", "blind", "lmcut", "landmark")
"""The names of pyperplan's heuristics."""

_UNINFORMED_SEARCHES: Final = frozenset({"bfs", "ids"})


class PyperplanPlanner(Planner):
    """Pyperplan without action costs. ``astar`` with an admissible heuristic minimises the number of actions.

    :param search: one of :data:`SEARCHES`.
    :param heuristic: one of :data:`HEURISTICS`.
    :raises UnknownPlannerError: if an option is unknown.
    """

    name = "pyperplan"
    understands = CLASSICAL
    # effects on numbers have no influence on a plan if no condition needs NUMBERS
    ignores = frozenset({Need.COSTS, Need.NUMERIC_CHANGES})

    def __init__(self, search: str = "gbf", heuristic: str = "hff") -> None:
        for option, name, known_names in (
            ("search", search, SEARCHES),
            ("heuristic", heuristic, HEURISTICS),
        ):
            if name not in known_names:
                raise UnknownPlannerError(
                    f"pyperplan has no {option} '{name}'", hint=f"use one of: {', '.join(known_names)}"
                )
        self.search = search
        self.heuristic = heuristic

    def solve(self, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return a plan; None if the search ends without one.

        Then the search has exhausted the reachable states, except for ``ehs``, which may give up early.

        :raises PlanningError: if the grounded task is too large, or a condition or an effect is unsupported.
        """
        strips_task = ground(domain, problem)
        if strips_task.goal <= strips_task.initial:
            return ()
        operators = self._search(strips_task)
        if operators is None:
            return None
        return tuple(operator.action for operator in operators if operator.action is not None)

    def _search(self, strips_task: StripsTask) -> list[Operator] | None:
        # slow imports, which only the planner's process needs
        from pyperplan import planner as pyperplan  # noqa: PLC0415
        from pyperplan.task import Operator as PyOperator  # noqa: PLC0415
        from pyperplan.task import Task  # noqa: PLC0415

        logging.getLogger().setLevel(logging.WARNING)  # pyperplan logs its progress with the root logger
        # numbers are fast and reproducibly ordered, but the heuristic lmcut expects texts
        fact_ids = [
            str(number) if self.heuristic == "lmcut" else number for number in range(len(strips_task.facts))
        ]

        def select_facts(numbers: frozenset[int]) -> frozenset[int | str]:
            return frozenset(fact_ids[number] for number in numbers)

        operators = [
            PyOperator(
                str(number),
                select_facts(operator.preconditions),
                select_facts(operator.adds),
                select_facts(operator.deletes),
            )
            for number, operator in enumerate(strips_task.operators)
        ]
        task = Task(
            "task",
            set(fact_ids),
            select_facts(strips_task.initial),
            select_facts(strips_task.goal),
            operators,
        )
        search = pyperplan.SEARCHES[self.search]
        # an uninformed search has no parameter for a heuristic
        heuristic_arguments = (
            () if self.search in _UNINFORMED_SEARCHES else (pyperplan.HEURISTICS[self.heuristic](task),)
        )
        steps = search(task, *heuristic_arguments)
        return None if steps is None else [strips_task.operators[int(step.name)] for step in steps]
