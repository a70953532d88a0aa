"""A PDDL problem that services change: objects, fluents, functions, and several goals with filters.

As in the node ``pddl_manager`` of the ROS 2 CX, which reads PDDL with unified-planning, names are in lower
case, and a domain may use requirements that it does not declare.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from typing import Final

from msgspec import Struct
from msgspec.structs import replace

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import Domain, Problem, parse_domain, parse_problem
from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Constant,
    Formula,
    FunctionTerm,
    Ground,
    Not,
    NumericChange,
    Term,
    TermComparison,
    Timed,
    TypedList,
    Variable,
    names_of,
    pairs_of,
)
from cxbridge.executive.pddl.problems import problem_of_facts
from cxbridge.executive.problem.truth import KnownState

BASE_GOAL: Final = "base"  # the name of the goal that each problem has from the start

_REQUIREMENTS: Final = (
    ":strips :typing :negative-preconditions :disjunctive-preconditions :equality :quantified-preconditions"
    " :conditional-effects :fluents :numeric-fluents :durative-actions :adl"
)
_REQUIREMENTS_SECTION: Final = re.compile(r"\(\s*:requirements[^()]*\)")
_DOMAIN_HEAD: Final = re.compile(r"\(\s*define\s*\(\s*domain\s+[^\s()]+\s*\)")
_COMMENT: Final = re.compile(r";[^\n]*")
_TIME_POINTS: Final = {"at start": "START", "at end": "END"}
_OPERATORS: Final = {"assign": "=", "increase": "+", "decrease": "-"}


class FluentChange(Struct, frozen=True):
    """The effect of an action on a fluent or a function.

    :param time_point: START or END.
    :param sign: the operator on a function's value: ``=``, ``+`` or ``-``; empty for a fluent.
    :param value: the operand; for a fluent, 1.0 means true and 0.0 means false.
    """

    ground: Ground
    time_point: str
    sign: str
    value: float


class ManagedGoal(Struct):
    """A goal, and the names of the objects, actions and fluents that planning keeps; empty to keep all."""

    formulas: list[Formula] = []
    kept_objects: tuple[str, ...] = ()
    kept_actions: tuple[str, ...] = ()
    kept_fluents: tuple[str, ...] = ()


class ManagedProblem:
    """A PDDL problem that services change.

    :param problem_text: the text of the problem; empty for a problem without objects and facts.
    """

    def __init__(self, domain_text: str, problem_text: str = "", file: str = "") -> None:
        self.domain = domain = parse_domain(_declare_all_requirements(domain_text), file)
        self.objects: dict[str, str] = dict(pairs_of(domain.constants))
        self.fluents: dict[Ground, None] = {}  # the true fluents; a dict keeps their order
        self.functions: dict[Ground, float] = {}
        self.goals: dict[str, ManagedGoal] = {BASE_GOAL: ManagedGoal()}
        self._parents = {name: parent or "object" for name, parent in pairs_of(domain.types)}
        self._predicate_parameters = {predicate.name: predicate.parameters for predicate in domain.predicates}
        self._function_parameters = {function.name: function.parameters for function in domain.functions}
        if problem_text:
            problem = parse_problem(_COMMENT.sub("", problem_text).lower(), domain, file)
            self.objects.update(
                (name, type_name or "object") for name, type_name in pairs_of(problem.objects)
            )
            self.fluents = dict.fromkeys(
                (atom.predicate, _list_argument_names(atom.arguments)) for atom in problem.init
            )
            self.functions = {
                (call.function, _list_argument_names(call.arguments)): value
                for call, value in problem.numbers
            }

    # --- objects and facts --------------------------------------------------------------------------------

    def _make_ground(self, name: str, arguments: Sequence[str]) -> Ground:
        """Return a fluent or function with its arguments.

        :raises PddlError: if an argument is not an object of the problem.
        """
        for argument in arguments:
            if argument not in self.objects:
                raise PddlError(f"there is no object '{argument}'")
        return name, tuple(arguments)

    def set_fluent(self, name: str, arguments: Sequence[str], *, value: bool) -> None:
        """Set the truth of a fluent.

        :raises PddlError: if the predicate or an object is unknown.
        """
        self._check_arguments(name, arguments, self._predicate_parameters)
        ground = self._make_ground(name, arguments)
        if value:
            self.fluents[ground] = None
        else:
            self.fluents.pop(ground, None)

    def set_function(self, name: str, arguments: Sequence[str], value: float) -> None:
        """Set the value of a function.

        :raises PddlError: if the function or an object is unknown.
        """
        self._check_arguments(name, arguments, self._function_parameters)
        self.functions[self._make_ground(name, arguments)] = value

    @staticmethod
    def _check_arguments(
        name: str, arguments: Sequence[str], declared_parameters: dict[str, TypedList]
    ) -> None:
        if name not in declared_parameters:
            raise PddlError(f"the domain has no '{name}'", hint=f"it has: {', '.join(declared_parameters)}")
        count = len(names_of(declared_parameters[name]))
        if len(arguments) != count:
            raise PddlError(f"'{name}' has {count} arguments, not {len(arguments)}")

    def add_object(self, name: str, type_name: str) -> None:
        if type_name not in self._parents and type_name != "object":
            raise PddlError(f"the domain has no type '{type_name}'")
        if name in self.objects:
            raise PddlError(f"the object '{name}' already exists")
        self.objects[name] = type_name

    def remove_object(self, name: str) -> None:
        self.objects.pop(name, None)
        for table in (self.fluents, self.functions):
            for ground in list(table):
                _, arguments = ground
                if name in arguments:
                    table.pop(ground)

    def find_objects(self, type_names: Sequence[str]) -> list[str]:
        """Return the objects of types and of their subtypes; all objects if no type is given."""
        return [
            name
            for name, type_name in self.objects.items()
            if not type_names or self._is_subtype(type_name, type_names)
        ]

    def _is_subtype(self, type_name: str, type_names: Sequence[str]) -> bool:
        visited: set[str] = set()  # a domain may have types that inherit from each other in a circle
        while type_name not in type_names and type_name in self._parents and type_name not in visited:
            visited.add(type_name)
            type_name = self._parents[type_name]
        return type_name in type_names

    def has_type(self, type_name: str) -> bool:
        return type_name == "object" or type_name in self._parents

    # --- actions ------------------------------------------------------------------------------------------

    def _bind_arguments(
        self, action: str, arguments: Sequence[str]
    ) -> tuple[Formula | None, Formula | None, dict[str, str]]:
        """Return the condition and the effect of an action, and the values of its variables."""
        action_definition = next((item for item in self.domain.actions if item.name == action), None)
        if action_definition is None:
            raise PddlError(f"the domain has no action '{action}'")
        variables = names_of(action_definition.parameters)
        if len(variables) != len(arguments):
            raise PddlError(f"'{action}' has {len(variables)} arguments, not {len(arguments)}")
        return (
            action_definition.condition,
            action_definition.effect,
            dict(zip(variables, self._make_ground(action, arguments)[1], strict=True)),
        )

    def find_unsatisfied_conditions(self, action: str, arguments: Sequence[str]) -> list[str]:
        """Return the unsatisfied start conditions of an action.

        :raises PddlError: if the action or an object is unknown.
        """
        condition, _, bindings = self._bind_arguments(action, arguments)
        known_state = KnownState(self.fluents, self.functions, self.find_objects)
        return [
            _format_condition(conjunct, bindings)
            for time, conjunct in _find_conjuncts(condition)
            if time == "START" and not conjunct.holds(known_state, bindings)
        ]

    def list_action_changes(self, action: str, arguments: Sequence[str]) -> Iterator[FluentChange]:
        """Yield the changes that an action makes.

        :raises PddlError: if the action or an object is unknown, or an effect is conditional.
        """
        _, effect, bindings = self._bind_arguments(action, arguments)
        known_state = KnownState(self.fluents, self.functions, self.find_objects)
        for time, conjunct in _find_conjuncts(effect):
            match conjunct:
                case Atom(predicate=name, arguments=terms):
                    yield FluentChange((name, _list_argument_names(terms, bindings)), time, "", 1.0)
                case Not(part=Atom(predicate=name, arguments=terms)):
                    yield FluentChange((name, _list_argument_names(terms, bindings)), time, "", 0.0)
                case NumericChange(operator=operator, target=FunctionTerm() as target, amount=amount) if (
                    operator in _OPERATORS
                ):
                    value = known_state.number(amount, bindings)
                    if value is None:
                        raise PddlError(
                            f"'{action}' changes {target.function} by an expression without a value"
                        )
                    yield FluentChange(
                        (target.function, _list_argument_names(target.arguments, bindings)),
                        time,
                        _OPERATORS[operator],
                        value,
                    )
                case _:
                    raise PddlError(f"an effect of '{action}' is neither a fluent nor a function")

    # --- goals --------------------------------------------------------------------------------------------

    def find_goal(self, name: str) -> ManagedGoal:
        """Return a goal of the problem.

        :raises PddlError: if there is no such goal.
        """
        if name not in self.goals:
            raise PddlError(
                f"there is no goal instance '{name}'", hint=f"the problem has: {', '.join(self.goals)}"
            )
        return self.goals[name]

    def add_goal_fluent(self, goal: str, name: str, arguments: Sequence[str]) -> None:
        """Add a fluent to a goal.

        :raises PddlError: if the goal, the predicate or an object is unknown.
        """
        self._check_arguments(name, arguments, self._predicate_parameters)
        ground = self._make_ground(name, arguments)
        self.find_goal(goal).formulas.append(Atom(name, tuple(map(Constant, ground[1]))))

    def add_goal_function(self, goal: str, name: str, arguments: Sequence[str], value: float) -> None:
        """Add a function value to a goal.

        :raises PddlError: if the goal, the function or an object is unknown.
        """
        self._check_arguments(name, arguments, self._function_parameters)
        ground = self._make_ground(name, arguments)
        term = FunctionTerm(name, tuple(map(Constant, ground[1])))
        self.find_goal(goal).formulas.append(TermComparison("=", term, Constant(f"{value:g}")))

    def filter_problem(self, goal: str, name: str) -> tuple[Domain, Problem]:
        """Return the domain and the problem of a goal, with the filters of the goal applied.

        :param name: the name of the returned problem.
        """
        managed_goal = self.find_goal(goal)
        is_kept_object = _make_filter(managed_goal.kept_objects)
        is_kept_fluent = _make_filter(managed_goal.kept_fluents)
        is_kept_action = _make_filter(managed_goal.kept_actions)
        domain = self.domain
        if managed_goal.kept_actions:
            kept_actions = tuple(action for action in domain.actions if is_kept_action(action.name))
            # without the text, which has all actions: planners then get a text of the kept actions
            domain = replace(domain, actions=kept_actions, text="")

        def is_kept(ground: Ground) -> bool:
            return is_kept_fluent(ground[0]) and all(map(is_kept_object, ground[1]))

        problem = problem_of_facts(
            domain,
            [(name, type_name) for name, type_name in self.objects.items() if is_kept_object(name)],
            [fluent for fluent in self.fluents if is_kept(fluent)],
            And(tuple(managed_goal.formulas)),
            re.sub(r"\W", "_", name) or "problem",
            [(ground, value) for ground, value in self.functions.items() if is_kept(ground)],
        )
        return domain, problem


def _make_filter(names: tuple[str, ...]) -> Callable[[str], bool]:
    return lambda name: not names or name in names


def _declare_all_requirements(text: str) -> str:
    """Return a domain without comments, in lower case, that declares all requirements."""
    stripped_text = _REQUIREMENTS_SECTION.sub("", _COMMENT.sub("", text).lower())
    return _DOMAIN_HEAD.sub(lambda head: f"{head[0]} (:requirements {_REQUIREMENTS})", stripped_text, count=1)


def _list_argument_names(terms: Sequence[Term], bindings: dict[str, str] | None = None) -> tuple[str, ...]:
    names = []
    for term in terms:
        if isinstance(term, Variable) and bindings is not None:
            names.append(bindings.get(term.name, term.name))
        else:
            names.append(getattr(term, "name", ""))
    return tuple(names)


def _find_conjuncts(formula: Formula | None, time: str = "START") -> Iterator[tuple[str, Formula]]:
    """Yield the formulas of a conjunction, each after its time point: START, END or ALL."""
    match formula:
        case None:
            return
        case And(parts=formulas):
            for conjunct in formulas:
                yield from _find_conjuncts(conjunct, time)
        case Timed(when=when, part=timed):
            yield from _find_conjuncts(timed, _TIME_POINTS.get(when, "ALL"))
        case _:
            yield time, formula


def _format_condition(formula: Formula, bindings: dict[str, str]) -> str:
    """Return a condition in unified-planning's notation."""
    match formula:
        case Atom(predicate=name, arguments=terms):
            arguments = ", ".join(_list_argument_names(terms, bindings))
            return f"{name}({arguments})" if arguments else name
        case Not(part=negated):
            return f"(not {_format_condition(negated, bindings)})"
        case _:
            from cxbridge.executive.pddl.printer import format_formula  # noqa: PLC0415 - few conditions are neither atoms nor negations

            return format_formula(formula)
