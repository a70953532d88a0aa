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
from cxbridge_planning.compile.conditions import Conjunction, DnfConverter, Fact, fact_of
from cxbridge_planning.compile.effects import EffectCase, find_changed_predicates, find_effect_cases
from cxbridge_planning.compile.join import FactIndex, SchemaToGround
from cxbridge_planning.compile.strips import Operator, StripsTask, remove_irrelevant_parts
from cxbridge_planning.errors import PlanningError
from cxbridge_planning.objects import ObjectTable

# chosen freely
MAX_OPERATORS: Final = 200_000
"""The maximum number of cases of ground actions and of the goal. A case becomes at most one operator."""

# pyperplan's goals are conjunctions: auxiliary operators lead from each alternative of the goal to this fact;
# no predicate of PDDL has a blank in its name
_GOAL_FACT: Final = Fact("goal reached", ())


@dataclass(slots=True)
class _GroundCase:
    """A case of a ground action, or of the goal (without action).

    :param missing_count: the number of positive facts of the condition that are not reached and joined yet.
    """

    action: PlannedAction | None
    case: EffectCase
    missing_count: int = 0


def ground(domain: Domain, problem: Problem) -> StripsTask:
    """Return the STRIPS task of a problem without numbers.

    :raises PlanningError: if the task becomes too large, or a condition or an effect is not supported.
    """
    return _Grounder(domain, problem, MAX_OPERATORS).make_task()


def find_reachable_facts(domain: Domain, problem: Problem, max_operators: int) -> frozenset[Fact]:
    """Return the facts reachable without deletions, including the initial facts.

    :param max_operators: the maximum number of cases of ground actions and of the goal.
    :raises PlanningError: if there are more cases, or a condition or an effect is not supported.
    """
    grounder = _Grounder(domain, problem, max_operators)
    return frozenset((*grounder.initial_facts, *grounder.reached_facts))


class _Grounder:
    """The state of one grounding.

    :ivar initial_facts: the initial facts.
    :ivar reached_facts: the reachable facts of predicates that actions change.
    """

    def __init__(self, domain: Domain, problem: Problem, max_operators: int) -> None:
        self._max_operators = max_operators
        # dictionaries in place of sets: a reproducible order of facts makes plans reproducible
        self.initial_facts = dict.fromkeys(fact_of(atom, {}) for atom in problem.init)
        self.reached_facts: dict[Fact, None] = {}
        self._fluents = {  # the predicates that actions change
            predicate for action in domain.actions for predicate in find_changed_predicates(action.effect)
        }
        objects = ObjectTable(domain, problem)
        self._converter = DnfConverter(objects, self._static_truth)
        self._schemas = [SchemaToGround(action, objects) for action in domain.actions]
        self._index = FactIndex()
        self._queue: deque[Fact] = deque()  # reached facts that are not joined yet
        self._joined_facts: set[Fact] = set()
        # the actions that are grounded, each by its index and its objects
        self._grounded_choices: set[tuple[int, tuple[str, ...]]] = set()
        self._cases_by_missing_fact: dict[Fact, list[_GroundCase]] = {}
        self._applicable_cases: list[_GroundCase] = []  # cases without missing facts
        self._case_count = 0
        self._explore(problem.goal)

    def _static_truth(self, fact: Fact) -> bool | None:
        """Return the truth of a fact that no action changes; None for other facts."""
        return None if fact.predicate in self._fluents else fact in self.initial_facts

    def _explore(self, goal: Formula) -> None:
        """Ground the goal, and all actions whose conditions are reachable."""
        for conjunction in self._converter.find_alternatives(goal, {}):
            self._add_case(_GroundCase(None, EffectCase(conjunction, frozenset())))
        for fact in self.initial_facts:
            if fact.predicate not in self._fluents:
                self._index.add(fact)
        for schema_index, schema in enumerate(self._schemas):
            # an action without fluent atoms would never be joined with a new fact
            if not any(atom.predicate in self._fluents for atom in schema.atoms):
                self._ground_all(schema_index, schema.find_matches(self._index))
        self._add_reached_facts(fact for fact in self.initial_facts if fact.predicate in self._fluents)
        atom_indices = self._find_atom_indices()
        while self._queue:
            fact = self._queue.popleft()
            # before the join, since two atoms of an action may match this fact
            self._index.add(fact)
            for schema_index, position in atom_indices.get(fact.predicate, ()):
                self._ground_all(
                    schema_index, self._schemas[schema_index].find_matches(self._index, (position, fact))
                )
            self._joined_facts.add(fact)
            for ground_case in self._cases_by_missing_fact.pop(fact, ()):
                ground_case.missing_count -= 1
                if not ground_case.missing_count:
                    self._apply_case(ground_case)

    def _find_atom_indices(self) -> dict[str, list[tuple[int, int]]]:
        """Return the required atoms by predicate: the index of the schema, and the atom's index in it."""
        indices: dict[str, list[tuple[int, int]]] = {}
        for schema_index, schema in enumerate(self._schemas):
            for position, atom in enumerate(schema.atoms):
                indices.setdefault(atom.predicate, []).append((schema_index, position))
        return indices

    def _add_reached_facts(self, facts: Iterable[Fact]) -> None:
        """Record and queue the facts that are new."""
        for fact in facts:
            if fact not in self.reached_facts:
                self.reached_facts[fact] = None
                self._queue.append(fact)

    def _ground_all(self, schema_index: int, choices: Iterable[tuple[str, ...]]) -> None:
        """Ground an action, given by its index, for several choices of objects."""
        for choice in choices:
            # the join of each fact in an action's condition finds the same choice
            if (schema_index, choice) not in self._grounded_choices:
                self._grounded_choices.add((schema_index, choice))
                self._ground(self._schemas[schema_index], choice)

    def _ground(self, schema: SchemaToGround, choice: tuple[str, ...]) -> None:
        """Add the cases of an action with chosen objects."""
        action, binding = schema.action, dict(zip(schema.parameters, choice, strict=True))
        for conjunction in self._converter.find_alternatives(action.condition, binding):
            for case in find_effect_cases(self._converter, conjunction, action.effect, binding):
                self._add_case(_GroundCase(PlannedAction(action.name, choice), case))

    def _add_case(self, ground_case: _GroundCase) -> None:
        """Add a case, which waits for its positive facts.

        Negative facts do not count, because deletions are ignored.

        :raises PlanningError: if there are too many cases.
        """
        if self._case_count >= self._max_operators:
            raise PlanningError(
                f"the problem has more than {self._max_operators} ground actions",
                hint="use another planner (fast-downward), or leave out objects that do not matter",
            )
        self._case_count += 1
        missing_facts = ground_case.case.condition.positive - self._joined_facts
        ground_case.missing_count = len(missing_facts)
        for fact in missing_facts:
            self._cases_by_missing_fact.setdefault(fact, []).append(ground_case)
        if not missing_facts:
            self._apply_case(ground_case)

    def _apply_case(self, ground_case: _GroundCase) -> None:
        """Record a case without missing facts, and the facts that it makes true."""
        self._applicable_cases.append(ground_case)
        self._add_reached_facts(change.fact for change in ground_case.case.changes if change.becomes_true)

    def make_task(self) -> StripsTask:
        """Return the task of the explored actions."""
        numbers: dict[Fact, int] = {}

        def number_facts(facts: Iterable[Fact]) -> frozenset[int]:
            return frozenset(numbers.setdefault(fact, len(numbers)) for fact in facts)

        initial_fluents = [fact for fact in self.initial_facts if fact.predicate in self._fluents]
        # true at the start and never deleted, so that a case which needs such a fact to be false is useless
        permanent_facts = set(initial_fluents) - {
            change.fact
            for ground_case in self._applicable_cases
            for change in ground_case.case.changes
            if not change.becomes_true
        }
        usable_cases = [
            ground_case
            for ground_case in self._applicable_cases
            if not ground_case.case.condition.negative & permanent_facts
        ]
        # a fact that is never reached is always false, and needs no opposite
        opposites = {
            fact: Fact(f"not {fact.predicate}", fact.arguments)
            for ground_case in usable_cases
            for fact in sorted(ground_case.case.condition.negative)
            if fact in self.reached_facts
        }

        def number_literals(true_facts: Iterable[Fact], false_facts: Iterable[Fact]) -> frozenset[int]:
            """Return the numbers of facts, and of the opposites of the facts that are false."""
            # sorted: sets of texts have another order in each process, and plans depend on the numbers
            true_opposites = (opposites[fact] for fact in sorted(false_facts) if fact in opposites)
            return number_facts((*sorted(true_facts), *true_opposites))

        def number_condition(condition: Conjunction) -> frozenset[int]:
            return number_literals(condition.positive, condition.negative)

        initial_opposites = (
            opposite for fact, opposite in opposites.items() if fact not in self.initial_facts
        )
        initial_numbers = number_facts((*initial_fluents, *initial_opposites))
        goals = [number_condition(goal.case.condition) for goal in usable_cases if goal.action is None]
        operators = []
        for ground_case in usable_cases:
            if ground_case.action is not None:
                changes = ground_case.case.changes
                adds = {change.fact for change in changes if change.becomes_true}
                # as in PDDL, a fact that an action deletes and adds is true afterwards
                deletes = {change.fact for change in changes if not change.becomes_true} - adds
                preconditions = number_condition(ground_case.case.condition)
                # the opposite of an added fact is deleted, and vice versa
                effects = (number_literals(adds, deletes), number_literals(deletes, adds))
                operators.append(Operator(ground_case.action, preconditions, *effects))
        if len(goals) == 1:
            goal = goals[0]
        else:
            goal = number_facts((_GOAL_FACT,))
            operators += [Operator(None, alternative, goal, frozenset()) for alternative in goals]
        return remove_irrelevant_parts(StripsTask(tuple(numbers), initial_numbers, goal, tuple(operators)))
