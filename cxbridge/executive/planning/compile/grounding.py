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
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import ActionSchema, And, Atom, Domain, Formula, Problem
from cxbridge.executive.pddl.types import ObjectTable, domains_of
from cxbridge.executive.planning.compile.conditions import Conjunction, Evaluator, Fact, fact_of
from cxbridge.executive.planning.compile.effects import Case, cases, changed_predicates
from cxbridge.executive.planning.compile.join import FactIndex, Schema
from cxbridge.executive.planning.compile.strips import GroundAction, Operator, StripsTask, without_irrelevant
from cxbridge.executive.planning.errors import PlanningError

MAX_OPERATORS: Final = 200_000
"""The maximum number of ground actions in memory."""

_GOAL: Final = Fact("goal reached", ())


class _Bound(NamedTuple):
    """A case of a ground action, or of the goal (without action)."""

    action: GroundAction | None
    case: Case


def ground(domain: Domain, problem: Problem) -> StripsTask:
    """Return the STRIPS task of a problem without numbers.

    :raises PlanningError: if the task becomes too large.
    """
    return _Grounder(domain, problem).task()


def reachable(domain: Domain, problem: Problem, most: int) -> frozenset[Fact]:
    """Return the facts reachable without deletions, including the initial facts.

    :param most: the maximum number of ground actions.
    :raises PlanningError: if the maximum is exceeded.
    """
    return _Grounder(domain, problem, most).reachable()


def _plain_atoms(condition: Formula | None) -> Iterator[Atom]:
    """Yield the atoms that are required in any case."""
    if isinstance(condition, Atom):
        yield condition
    elif isinstance(condition, And):
        for part in condition.parts:
            yield from _plain_atoms(part)


class _Grounder:
    def __init__(self, domain: Domain, problem: Problem, most: int | None = None) -> None:
        self._most = MAX_OPERATORS if most is None else most
        self._goal = problem.goal
        self._initial = dict.fromkeys(fact_of(atom, {}) for atom in problem.init)
        self._changing = {
            predicate for action in domain.actions for predicate in changed_predicates(action.effect)
        }
        self._evaluator = Evaluator(ObjectTable(domain, problem), self._static_truth)
        self._actions = domain.actions
        objects = ObjectTable(domain, problem)
        self._schemas = [
            Schema(domains_of(action.parameters, objects), tuple(_plain_atoms(action.condition)))
            for action in domain.actions
        ]
        self._index = FactIndex()
        self._reached: dict[Fact, None] = {}
        self._queue: deque[Fact] = deque()
        self._propagated: set[Fact] = set()
        self._seen: set[tuple[int, tuple[str, ...]]] = set()
        # By fact, the waiting cases: the index in `_bound`, and the number of missing facts.
        self._waiting: dict[Fact, list[list[int]]] = {}
        self._bound: list[_Bound] = []
        self._usable: list[_Bound] = []

    def _static_truth(self, fact: Fact) -> bool | None:
        return None if fact.predicate in self._changing else fact in self._initial

    def task(self) -> StripsTask:
        self._explore()
        return self._strips()

    def reachable(self) -> frozenset[Fact]:
        self._explore()
        return frozenset((*self._initial, *self._reached))

    def _explore(self) -> None:
        for conjunction in self._evaluator.alternatives(self._goal, {}):
            self._add(_Bound(None, Case(conjunction, frozenset())))
        fluents = []
        for fact in self._initial:
            if fact.predicate in self._changing:
                fluents.append(fact)
            else:
                self._index.add(fact)
        for number, schema in enumerate(self._schemas):
            if not any(atom.predicate in self._changing for atom in schema.atoms):
                self._bind_all(number, schema.matches(self._index))
        self._reach(fluents)
        users = self._users()
        while self._queue:
            fact = self._queue.popleft()
            self._index.add(fact)
            for number, position in users.get(fact.predicate, ()):
                self._bind_all(number, self._schemas[number].matches(self._index, position, fact))
            self._propagated.add(fact)
            for counter in self._waiting.pop(fact, ()):
                counter[1] -= 1
                if counter[1] == 0:
                    self._use(self._bound[counter[0]])

    def _users(self) -> dict[str, list[tuple[int, int]]]:
        """Return indices of schema and atom of the plain atoms, by predicate."""
        users: dict[str, list[tuple[int, int]]] = {}
        for number, schema in enumerate(self._schemas):
            for position, atom in enumerate(schema.atoms):
                users.setdefault(atom.predicate, []).append((number, position))
        return users

    def _reach(self, facts: Iterable[Fact]) -> None:
        for fact in facts:
            if fact not in self._reached:
                self._reached[fact] = None
                self._queue.append(fact)

    def _bind_all(self, number: int, choices: Iterable[tuple[str, ...]]) -> None:
        action = self._actions[number]
        names = [name for name, _ in self._schemas[number].parameters]
        for choice in choices:
            if (number, choice) not in self._seen:
                self._seen.add((number, choice))
                self._bind(action, choice, dict(zip(names, choice, strict=True)))

    def _bind(self, action: ActionSchema, choice: tuple[str, ...], binding: dict[str, str]) -> None:
        for conjunction in self._evaluator.alternatives(action.condition, binding):
            for case in cases(self._evaluator, conjunction, action.effect, binding):
                self._add(_Bound(GroundAction(action.name, choice), case))

    def _add(self, bound: _Bound) -> None:
        """Add a case that waits for its positive facts. Negative facts never block here."""
        if len(self._bound) >= self._most:
            raise PlanningError(
                f"the problem has more than {self._most} bound actions",
                hint="use another planner (fast-downward), or leave out objects that do not matter",
            )
        self._bound.append(bound)
        missing = [fact for fact in bound.case.condition.positive if fact not in self._propagated]
        counter = [len(self._bound) - 1, len(missing)]
        for fact in missing:
            self._waiting.setdefault(fact, []).append(counter)
        if not missing:
            self._use(bound)

    def _use(self, bound: _Bound) -> None:
        self._usable.append(bound)
        self._reach(change.fact for change in bound.case.changes if change.to)

    def _strips(self) -> StripsTask:
        numbers: dict[Fact, int] = {}

        def number(facts: Iterable[Fact]) -> frozenset[int]:
            return frozenset(numbers.setdefault(fact, len(numbers)) for fact in facts)

        initial = [fact for fact in self._initial if fact.predicate in self._changing]
        deletable = {change.fact for bound in self._usable for change in bound.case.changes if not change.to}
        always = {fact for fact in initial if fact not in deletable}
        usable = [bound for bound in self._usable if not bound.case.condition.negative & always]
        opposites = {
            fact: Fact(f"not {fact.predicate}", fact.arguments)
            for bound in usable
            for fact in sorted(bound.case.condition.negative)
            if fact in self._reached
        }

        def conditions(condition: Conjunction) -> frozenset[int]:
            false = (opposites[fact] for fact in sorted(condition.negative) if fact in opposites)
            return number((*sorted(condition.positive), *false))

        start = number((*initial, *(no for fact, no in opposites.items() if fact not in self._initial)))
        operators = []
        goals = [conditions(bound.case.condition) for bound in usable if bound.action is None]
        for action, case in usable:
            if action is not None:
                adds = {change.fact for change in case.changes if change.to}
                deletes = {change.fact for change in case.changes if not change.to} - adds
                true = (*sorted(adds), *(opposites[fact] for fact in sorted(deletes) if fact in opposites))
                false = (*sorted(deletes), *(opposites[fact] for fact in sorted(adds) if fact in opposites))
                operators.append(Operator(action, conditions(case.condition), number(true), number(false)))
        if len(goals) == 1:
            goal = goals[0]
        else:
            goal = number((_GOAL,))
            operators += [Operator(None, each, goal, frozenset()) for each in goals]
        return without_irrelevant(StripsTask(tuple(numbers), start, goal, tuple(operators)))
