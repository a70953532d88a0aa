"""Grounding of domain and problem to STRIPS, without features that simple planners lack.

Reachable actions are ground, where deletions are ignored: each new fact is joined with earlier facts
to the choices of objects that satisfy the plain atoms of an action. Then these features are compiled:

==================  ==========================================================================
negative condition  a fact for the falsehood, which the effects keep consistent
``or``, ``imply``   one operator per alternative
quantifiers         all objects
``when``            one operator per combination of the conditions
``=``               evaluated while grounding
==================  ==========================================================================
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from cxbridge.executive.pddl.ast import ActionSchema, Domain, Problem
from cxbridge.executive.pddl.types import ObjectTable
from cxbridge.executive.planning.compile.conditions import Conjunction, Evaluator, Fact, fact_of
from cxbridge.executive.planning.compile.effects import Case, cases, changed_predicates
from cxbridge.executive.planning.compile.join import FactIndex, Schema
from cxbridge.executive.planning.compile.strips import Operator, StripsTask, without_irrelevant
from cxbridge.executive.planning.errors import PlanningError
from cxbridge.executive.planning.planner import PlannedAction

MAX_OPERATORS: Final = 200_000
"""The maximum number of ground actions in memory."""

# pyperplan's goals are conjunctions: auxiliary operators lead from each alternative of the goal to this fact
_GOAL: Final = Fact("goal reached", ())


@dataclass(slots=True)
class _GroundCase:
    """A case of a ground action, or of the goal (without action).

    :param missing: the number of positive facts of the condition that are not reached yet.
    """

    action: PlannedAction | None
    case: Case
    missing: int = 0


def ground(domain: Domain, problem: Problem) -> StripsTask:
    """Return the STRIPS task of a problem without numbers.

    :raises PlanningError: if the task becomes too large.
    """
    grounder = _Grounder(domain, problem, MAX_OPERATORS)
    grounder.explore()
    return grounder.strips()


def reachable(domain: Domain, problem: Problem, max_operators: int) -> frozenset[Fact]:
    """Return the facts reachable without deletions, including the initial facts.

    :raises PlanningError: if there are more ground actions than ``max_operators``.
    """
    grounder = _Grounder(domain, problem, max_operators)
    grounder.explore()
    return frozenset((*grounder.initial, *grounder.reached))


class _Grounder:
    def __init__(self, domain: Domain, problem: Problem, max_operators: int) -> None:
        self._max_operators = max_operators
        self._goal = problem.goal
        # dictionaries in place of sets: a reproducible order of facts makes plans reproducible
        self.initial = dict.fromkeys(fact_of(atom, {}) for atom in problem.init)
        self.reached: dict[Fact, None] = {}
        self._fluents = {
            predicate for action in domain.actions for predicate in changed_predicates(action.effect)
        }
        objects = ObjectTable(domain, problem)
        self._evaluator = Evaluator(objects, self._static_truth)
        self._actions = domain.actions
        self._schemas = [Schema(action, objects) for action in domain.actions]
        self._index = FactIndex()
        self._queue: deque[Fact] = deque()
        self._propagated: set[Fact] = set()
        self._bindings: set[tuple[int, tuple[str, ...]]] = set()
        self._waiting: dict[Fact, list[_GroundCase]] = {}  # cases by missing fact
        self._applicable: list[_GroundCase] = []
        self._case_count = 0

    def _static_truth(self, fact: Fact) -> bool | None:
        return None if fact.predicate in self._fluents else fact in self.initial

    def explore(self) -> None:
        """Ground all actions whose conditions are reachable."""
        for conjunction in self._evaluator.alternatives(self._goal, {}):
            self._add(_GroundCase(None, Case(conjunction, frozenset())))
        for fact in self.initial:
            if fact.predicate not in self._fluents:
                self._index.add(fact)
        for number, schema in enumerate(self._schemas):
            # an action without fluent atoms would never be joined with a new fact
            if not any(atom.predicate in self._fluents for atom in schema.atoms):
                self._ground_all(number, schema.matches(self._index))
        self._reach(fact for fact in self.initial if fact.predicate in self._fluents)
        uses = self._uses()
        while self._queue:
            fact = self._queue.popleft()
            self._index.add(fact)
            for number, position in uses.get(fact.predicate, ()):
                self._ground_all(number, self._schemas[number].matches(self._index, (position, fact)))
            self._propagated.add(fact)
            for ground_case in self._waiting.pop(fact, ()):
                ground_case.missing -= 1
                if not ground_case.missing:
                    self._apply(ground_case)

    def _uses(self) -> dict[str, list[tuple[int, int]]]:
        """Return indices of schema and atom of the plain atoms, by predicate."""
        uses: dict[str, list[tuple[int, int]]] = {}
        for number, schema in enumerate(self._schemas):
            for position, atom in enumerate(schema.atoms):
                uses.setdefault(atom.predicate, []).append((number, position))
        return uses

    def _reach(self, facts: Iterable[Fact]) -> None:
        for fact in facts:
            if fact not in self.reached:
                self.reached[fact] = None
                self._queue.append(fact)

    def _ground_all(self, number: int, choices: Iterable[tuple[str, ...]]) -> None:
        action = self._actions[number]
        for choice in choices:
            # two new facts of an action's condition find the same binding
            if (number, choice) not in self._bindings:
                self._bindings.add((number, choice))
                self._ground(action, choice, dict(zip(self._schemas[number].parameters, choice, strict=True)))

    def _ground(self, action: ActionSchema, choice: tuple[str, ...], binding: dict[str, str]) -> None:
        for conjunction in self._evaluator.alternatives(action.condition, binding):
            for case in cases(self._evaluator, conjunction, action.effect, binding):
                self._add(_GroundCase(PlannedAction(action.name, choice), case))

    def _add(self, ground_case: _GroundCase) -> None:
        """Add a case that waits for its positive facts. Negative facts never block here."""
        if self._case_count >= self._max_operators:
            raise PlanningError(
                f"the problem has more than {self._max_operators} bound actions",
                hint="use another planner (fast-downward), or leave out objects that do not matter",
            )
        self._case_count += 1
        missing = ground_case.case.condition.positive - self._propagated
        ground_case.missing = len(missing)
        for fact in missing:
            self._waiting.setdefault(fact, []).append(ground_case)
        if not missing:
            self._apply(ground_case)

    def _apply(self, ground_case: _GroundCase) -> None:
        self._applicable.append(ground_case)
        self._reach(change.fact for change in ground_case.case.changes if change.to)

    def strips(self) -> StripsTask:
        """Return the task of the explored actions."""
        numbers: dict[Fact, int] = {}

        def number(facts: Iterable[Fact]) -> frozenset[int]:
            return frozenset(numbers.setdefault(fact, len(numbers)) for fact in facts)

        initial = [fact for fact in self.initial if fact.predicate in self._fluents]
        deletable = {
            change.fact
            for ground_case in self._applicable
            for change in ground_case.case.changes
            if not change.to
        }
        permanent = set(initial) - deletable
        usable = [
            ground_case
            for ground_case in self._applicable
            if not ground_case.case.condition.negative & permanent
        ]
        # a fact that is never reached is always false, and needs no opposite
        opposites = {
            fact: Fact(f"not {fact.predicate}", fact.arguments)
            for ground_case in usable
            for fact in sorted(ground_case.case.condition.negative)
            if fact in self.reached
        }

        def with_opposites(facts: Iterable[Fact], opposed: Iterable[Fact]) -> frozenset[int]:
            """Return the numbers of facts, and of the opposites of further facts."""
            # sorted: sets of texts have another order in each process, and plans depend on the numbers
            false = (opposites[fact] for fact in sorted(opposed) if fact in opposites)
            return number((*sorted(facts), *false))

        def conditions(condition: Conjunction) -> frozenset[int]:
            return with_opposites(condition.positive, condition.negative)

        start = number((*initial, *(no for fact, no in opposites.items() if fact not in self.initial)))
        goals = [conditions(goal.case.condition) for goal in usable if goal.action is None]
        operators = []
        for ground_case in usable:
            if ground_case.action is not None:
                changes = ground_case.case.changes
                adds = {change.fact for change in changes if change.to}
                deletes = {change.fact for change in changes if not change.to} - adds
                preconditions = conditions(ground_case.case.condition)
                effects = (with_opposites(adds, deletes), with_opposites(deletes, adds))
                operators.append(Operator(ground_case.action, preconditions, *effects))
        if len(goals) == 1:
            goal = goals[0]
        else:
            goal = number((_GOAL,))
            operators += [Operator(None, alternative, goal, frozenset()) for alternative in goals]
        return without_irrelevant(StripsTask(tuple(numbers), start, goal, tuple(operators)))
