"""Grounding of domain and problem to STRIPS, without features that simple planners lack.

Grounding makes a ground action for each choice of objects with which an action may become possible. It starts
with the initial facts, and ignores deletions. Each new fact is joined with earlier facts (:mod:`.join`) to
the choices of objects that satisfy the required atoms of an action; the effects of the ground action are new
facts. Then these features of PDDL are compiled to STRIPS:

==================  ==========================================================================
negative condition  a second fact, the opposite, which is true when the fact is false; effects change both
``or``, ``imply``   an operator for each alternative
quantifiers         a part for each object
``when``            an operator for each combination of the conditions
``=``               evaluated while grounding
==================  ==========================================================================
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from cxbridge.executive.pddl.ast import Domain, Formula, Problem
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.compile.conditions import Conjunction, Evaluator, Fact, fact_of
from cxbridge_planning.compile.effects import EffectCase, changed_predicates, effect_cases
from cxbridge_planning.compile.join import FactIndex, SchemaToGround
from cxbridge_planning.compile.strips import Operator, StripsTask, without_irrelevant
from cxbridge_planning.errors import PlanningError
from cxbridge_planning.objects import ObjectTable

MAX_OPERATORS: Final = 200_000
"""The maximum number of ground actions in memory."""

# pyperplan's goals are conjunctions: auxiliary operators lead from each alternative of the goal to this fact
_GOAL: Final = Fact("goal reached", ())


@dataclass(slots=True)
class _GroundCase:
    """A case of a ground action, or of the goal (without action).

    :param missing_count: the number of positive facts of the condition that are not reached yet.
    """

    action: PlannedAction | None
    case: EffectCase
    missing_count: int = 0


def ground(domain: Domain, problem: Problem) -> StripsTask:
    """Return the STRIPS task of a problem without numbers.

    :raises PlanningError: if the task becomes too large.
    """
    return _Grounder(domain, problem, MAX_OPERATORS).strips()


def reachable(domain: Domain, problem: Problem, max_operators: int) -> frozenset[Fact]:
    """Return the facts reachable without deletions, including the initial facts.

    :raises PlanningError: if there are more ground actions than ``max_operators``.
    """
    grounder = _Grounder(domain, problem, max_operators)
    return frozenset((*grounder.initial, *grounder.reached))


class _Grounder:
    """The state of one grounding.

    :ivar initial: the initial facts.
    :ivar reached: the reachable facts of predicates that actions change.
    """

    def __init__(self, domain: Domain, problem: Problem, max_operators: int) -> None:
        self._max_operators = max_operators
        # dictionaries in place of sets: a reproducible order of facts makes plans reproducible
        self.initial = dict.fromkeys(fact_of(atom, {}) for atom in problem.init)
        self.reached: dict[Fact, None] = {}
        self._fluents = {  # the predicates that actions change
            predicate for action in domain.actions for predicate in changed_predicates(action.effect)
        }
        objects = ObjectTable(domain, problem)
        self._evaluator = Evaluator(objects, self._static_truth)
        self._schemas = [SchemaToGround(action, objects) for action in domain.actions]
        self._index = FactIndex()
        self._queue: deque[Fact] = deque()  # reached facts that are not joined yet
        self._joined: set[Fact] = set()
        self._bindings: set[tuple[int, tuple[str, ...]]] = set()  # index of the action, and its objects
        self._waiting: dict[Fact, list[_GroundCase]] = {}  # cases by missing fact
        self._applicable: list[_GroundCase] = []  # cases without missing facts
        self._case_count = 0
        self._explore(problem.goal)

    def _static_truth(self, fact: Fact) -> bool | None:
        """Return the truth of a fact that no action changes; None for other facts."""
        return None if fact.predicate in self._fluents else fact in self.initial

    def _explore(self, goal: Formula) -> None:
        """Ground the goal, and all actions whose conditions are reachable."""
        for conjunction in self._evaluator.alternatives(goal, {}):
            self._add(_GroundCase(None, EffectCase(conjunction, frozenset())))
        for fact in self.initial:
            if fact.predicate not in self._fluents:
                self._index.add(fact)
        for schema_index, schema in enumerate(self._schemas):
            # an action without fluent atoms would never be joined with a new fact
            if not any(atom.predicate in self._fluents for atom in schema.atoms):
                self._ground_all(schema_index, schema.matches(self._index))
        self._reach(fact for fact in self.initial if fact.predicate in self._fluents)
        atoms = self._atom_indices()
        while self._queue:
            fact = self._queue.popleft()
            self._index.add(fact)
            for schema_index, position in atoms.get(fact.predicate, ()):
                self._ground_all(
                    schema_index, self._schemas[schema_index].matches(self._index, (position, fact))
                )
            self._joined.add(fact)
            for ground_case in self._waiting.pop(fact, ()):
                ground_case.missing_count -= 1
                if not ground_case.missing_count:
                    self._apply(ground_case)

    def _atom_indices(self) -> dict[str, list[tuple[int, int]]]:
        """Return the required atoms by predicate: the index of the schema, and the atom's index in it."""
        indices: dict[str, list[tuple[int, int]]] = {}
        for schema_index, schema in enumerate(self._schemas):
            for position, atom in enumerate(schema.atoms):
                indices.setdefault(atom.predicate, []).append((schema_index, position))
        return indices

    def _reach(self, facts: Iterable[Fact]) -> None:
        """Queue the facts that are new."""
        for fact in facts:
            if fact not in self.reached:
                self.reached[fact] = None
                self._queue.append(fact)

    def _ground_all(self, schema_index: int, choices: Iterable[tuple[str, ...]]) -> None:
        """Ground the action with an index for several choices of objects."""
        for choice in choices:
            # each of the facts in an action's condition finds the same binding
            if (schema_index, choice) not in self._bindings:
                self._bindings.add((schema_index, choice))
                self._ground(self._schemas[schema_index], choice)

    def _ground(self, schema: SchemaToGround, choice: tuple[str, ...]) -> None:
        """Add the cases of an action with chosen objects."""
        action, binding = schema.action, dict(zip(schema.parameters, choice, strict=True))
        for conjunction in self._evaluator.alternatives(action.condition, binding):
            for case in effect_cases(self._evaluator, conjunction, action.effect, binding):
                self._add(_GroundCase(PlannedAction(action.name, choice), case))

    def _add(self, ground_case: _GroundCase) -> None:
        """Add a case, which waits for its positive facts.

        Negative facts do not count, because deletions are ignored.
        """
        if self._case_count >= self._max_operators:
            raise PlanningError(
                f"the problem has more than {self._max_operators} ground actions",
                hint="use another planner (fast-downward), or leave out objects that do not matter",
            )
        self._case_count += 1
        missing = ground_case.case.condition.positive - self._joined
        ground_case.missing_count = len(missing)
        for fact in missing:
            self._waiting.setdefault(fact, []).append(ground_case)
        if not missing:
            self._apply(ground_case)

    def _apply(self, ground_case: _GroundCase) -> None:
        """Record a case without missing facts, and reach the facts that it makes true."""
        self._applicable.append(ground_case)
        self._reach(change.fact for change in ground_case.case.changes if change.value)

    def strips(self) -> StripsTask:
        """Return the task of the explored actions."""
        numbers: dict[Fact, int] = {}

        def fact_numbers(facts: Iterable[Fact]) -> frozenset[int]:
            return frozenset(numbers.setdefault(fact, len(numbers)) for fact in facts)

        initial = [fact for fact in self.initial if fact.predicate in self._fluents]
        permanent = set(initial) - {
            change.fact
            for ground_case in self._applicable
            for change in ground_case.case.changes
            if not change.value
        }
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

        def literal_numbers(true_facts: Iterable[Fact], false_facts: Iterable[Fact]) -> frozenset[int]:
            """Return the numbers of facts, and of the opposites of the facts that are false."""
            # sorted: sets of texts have another order in each process, and plans depend on the numbers
            false = (opposites[fact] for fact in sorted(false_facts) if fact in opposites)
            return fact_numbers((*sorted(true_facts), *false))

        def condition_numbers(condition: Conjunction) -> frozenset[int]:
            return literal_numbers(condition.positive, condition.negative)

        start = fact_numbers(
            (*initial, *(opposite for fact, opposite in opposites.items() if fact not in self.initial))
        )
        goals = [condition_numbers(goal.case.condition) for goal in usable if goal.action is None]
        operators = []
        for ground_case in usable:
            if ground_case.action is not None:
                changes = ground_case.case.changes
                adds = {change.fact for change in changes if change.value}
                deletes = {change.fact for change in changes if not change.value} - adds
                preconditions = condition_numbers(ground_case.case.condition)
                effects = (literal_numbers(adds, deletes), literal_numbers(deletes, adds))
                operators.append(Operator(ground_case.action, preconditions, *effects))
        if len(goals) == 1:
            goal = goals[0]
        else:
            goal = fact_numbers((_GOAL,))
            operators += [Operator(None, alternative, goal, frozenset()) for alternative in goals]
        return without_irrelevant(StripsTask(tuple(numbers), start, goal, tuple(operators)))
