"""A PDDL problem that services change: objects, fluents, functions, and several goals with filters.

As in the node ``pddl_manager`` of the ROS 2 CX, which reads PDDL with unified-planning, names are in lower
case, and a domain may use requirements that it does not declare.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

from msgspec import Struct

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import Domain, Problem, parse_domain, parse_problem
from cxbridge.executive.pddl.ast import (
    EMPTY_BINDING,
    And,
    Atom,
    Binding,
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
from cxbridge.executive.pddl.printer import format_formula, format_number
from cxbridge.executive.pddl.problems import problem_of_facts
from cxbridge.executive.pddl.tokens import blank_comments
from cxbridge.executive.pddl.types import TypeHierarchy
from cxbridge.executive.problem.truth import KnownState

BASE_GOAL: Final = "base"  # the name of the goal that each problem has from the start

# the requirements that a domain may use without declaring them
_REQUIREMENTS: Final = (
    ":strips :typing :negative-preconditions :disjunctive-preconditions :equality :quantified-preconditions"
    " :conditional-effects :fluents :numeric-fluents :durative-actions :adl"
)
_REQUIREMENTS_SECTION: Final = re.compile(r"\(\s*:requirements[^()]*\)")
_DOMAIN_HEAD: Final = re.compile(r"\(\s*define\s*\(\s*domain\s+[^\s()]+\s*\)")
_TIME_POINTS: Final = {"at start": "START", "at end": "END"}
_OPERATORS: Final = {"assign": "=", "increase": "+", "decrease": "-"}


class FluentChange(Struct, frozen=True):
    """The effect of an action on a fluent or a function.

    :param ground: the name of the fluent or function, and its arguments.
    :param time_point: START or END.
    :param operator: the operator on a function's value: ``=``, ``+`` or ``-``; empty for a fluent.
    :param value: the operand; for a fluent, 1.0 means true and 0.0 means false.
    """

    ground: Ground
    time_point: str
    operator: str
    value: float


class ManagedGoal(Struct):
    """A goal, and the names of the objects, actions and fluents that planning keeps; empty to keep all.

    The names of fluents include those of functions.
    """

    formulas: list[Formula] = []
    kept_objects: tuple[str, ...] = ()
    kept_actions: tuple[str, ...] = ()
    kept_fluents: tuple[str, ...] = ()


class ManagedProblem:
    """A PDDL problem that services change.

    :param problem_text: the text of the problem, whose goal is ignored, as in ``pddl_manager``; empty for a
        problem with the objects of the domain alone, and without facts.
    :raises PddlError: if the domain or the problem is invalid.
    """

    def __init__(self, domain_text: str, problem_text: str = "", file: str = "") -> None:
        self.domain = domain = parse_domain(_declare_requirements(domain_text), file)
        self.objects: dict[str, str] = dict(pairs_of(domain.constants))
        self.fluents: dict[Ground, None] = {}  # the true fluents; a dict keeps their order
        self.functions: dict[Ground, float] = {}
        self.goals: dict[str, ManagedGoal] = {BASE_GOAL: ManagedGoal()}
        self._hierarchy = TypeHierarchy(domain.types)
        self._predicate_parameters = {predicate.name: predicate.parameters for predicate in domain.predicates}
        self._function_parameters = {function.name: function.parameters for function in domain.functions}
        if problem_text:
            problem = parse_problem(blank_comments(problem_text).lower(), domain, file)
            self.objects |= {name: type_name or "object" for name, type_name in pairs_of(problem.objects)}
            self.fluents = dict.fromkeys(
                (atom.predicate, _list_argument_names(atom.arguments)) for atom in problem.init
            )
            self.functions = {
                (call.function, _list_argument_names(call.arguments)): value
                for call, value in problem.numbers
            }

    # --- objects and facts --------------------------------------------------------------------------------

    def _make_ground(
        self, name: str, arguments: Sequence[str], declared_parameters: dict[str, TypedList]
    ) -> Ground:
        """Return a fluent or function with its arguments.

        :param declared_parameters: the parameters of the declared predicates or functions.
        :raises PddlError: if the predicate or function is not declared, or the arguments do not fit: their
            number differs from the declaration, or one is not an object.
        """
        if name not in declared_parameters:
            raise PddlError(f"the domain has no '{name}'", hint=f"it has: {', '.join(declared_parameters)}")
        self._check_arguments(name, arguments, declared_parameters[name])
        return name, tuple(arguments)

    def _check_arguments(self, name: str, arguments: Sequence[str], parameters: TypedList) -> None:
        count = len(names_of(parameters))
        if len(arguments) != count:
            raise PddlError(f"'{name}' has {count} arguments, not {len(arguments)}")
        for argument in arguments:
            if argument not in self.objects:
                raise PddlError(f"there is no object '{argument}'")

    def add_fluent(self, name: str, arguments: Sequence[str]) -> None:
        """Make a fluent true.

        :raises PddlError: if the predicate is unknown, or the arguments do not fit.
        """
        self.fluents[self._make_ground(name, arguments, self._predicate_parameters)] = None

    def remove_fluent(self, name: str, arguments: Sequence[str]) -> None:
        """Make a fluent false.

        :raises PddlError: if the predicate is unknown, or the arguments do not fit.
        """
        self.fluents.pop(self._make_ground(name, arguments, self._predicate_parameters), None)

    def set_function(self, name: str, arguments: Sequence[str], value: float) -> None:
        """Set the value of a function.

        :raises PddlError: if the function is unknown, or the arguments do not fit.
        """
        self.functions[self._make_ground(name, arguments, self._function_parameters)] = value

    def add_object(self, name: str, type_name: str) -> None:
        """Add an object.

        :raises PddlError: if the type is unknown, or the object exists already.
        """
        if not self.has_type(type_name):
            raise PddlError(f"the domain has no type '{type_name}'")
        if name in self.objects:
            raise PddlError(f"the object '{name}' already exists")
        self.objects[name] = type_name

    def remove_object(self, name: str) -> None:
        """Remove an object, and all fluents and functions about the object."""
        self.objects.pop(name, None)
        self.fluents = {
            (predicate, arguments): None for predicate, arguments in self.fluents if name not in arguments
        }
        self.functions = {
            (function, arguments): value
            for (function, arguments), value in self.functions.items()
            if name not in arguments
        }

    def find_objects(self, type_names: Sequence[str]) -> list[str]:
        """Return the objects of types and of their subtypes; all objects if no type is given."""
        return [
            name
            for name, type_name in self.objects.items()
            if not type_names or not self._hierarchy.supertypes(type_name).isdisjoint(type_names)
        ]

    def has_type(self, type_name: str) -> bool:
        return type_name == "object" or type_name in self._hierarchy.parents

    # --- actions ------------------------------------------------------------------------------------------

    def _bind_arguments(
        self, action: str, arguments: Sequence[str]
    ) -> tuple[Formula | None, Formula | None, dict[str, str]]:
        """Return the condition and the effect of an action, and the arguments by variable.

        The condition and the effect may be None: the action has none.

        :raises PddlError: if the action is unknown, or the arguments do not fit.
        """
        action_definition = next(
            (known_action for known_action in self.domain.actions if known_action.name == action), None
        )
        if action_definition is None:
            raise PddlError(f"the domain has no action '{action}'")
        self._check_arguments(action, arguments, action_definition.parameters)
        return (
            action_definition.condition,
            action_definition.effect,
            dict(zip(names_of(action_definition.parameters), arguments, strict=True)),
        )

    def find_unsatisfied_conditions(self, action: str, arguments: Sequence[str]) -> list[str]:
        """Return the unsatisfied start conditions of an action; see :func:`_format_condition`.

        :raises PddlError: if the action is unknown, or the arguments do not fit.
        """
        condition, _, bindings = self._bind_arguments(action, arguments)
        known_state = KnownState(self.fluents, self.functions, self.find_objects)
        return [
            _format_condition(conjunct, bindings)
            for time_point, conjunct in _find_conjuncts(condition)
            if time_point == "START" and not conjunct.holds(known_state, bindings)
        ]

    def list_action_changes(self, action: str, arguments: Sequence[str]) -> Iterator[FluentChange]:
        """Yield the changes that an action makes.

        :raises PddlError: if the action is unknown, the arguments do not fit, or an effect has no value or is
            neither a fluent nor a function, such as a conditional effect.
        """
        _, effect, bindings = self._bind_arguments(action, arguments)
        known_state = KnownState(self.fluents, self.functions, self.find_objects)
        for time_point, conjunct in _find_conjuncts(effect):
            match conjunct:
                case Atom(predicate=name, arguments=terms):
                    yield FluentChange((name, _list_argument_names(terms, bindings)), time_point, "", 1.0)
                case Not(part=Atom(predicate=name, arguments=terms)):
                    yield FluentChange((name, _list_argument_names(terms, bindings)), time_point, "", 0.0)
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
                        time_point,
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

        :raises PddlError: if the goal or the predicate is unknown, or the arguments do not fit.
        """
        self._make_ground(name, arguments, self._predicate_parameters)  # raises for unknown names
        self.find_goal(goal).formulas.append(Atom(name, tuple(map(Constant, arguments))))

    def add_goal_function(self, goal: str, name: str, arguments: Sequence[str], value: float) -> None:
        """Add a function value to a goal.

        :raises PddlError: if the goal or the function is unknown, or the arguments do not fit.
        """
        self._make_ground(name, arguments, self._function_parameters)  # raises for unknown names
        self.find_goal(goal).formulas.append(
            TermComparison(
                "=", FunctionTerm(name, tuple(map(Constant, arguments))), Constant(format_number(value))
            )
        )

    def filter_problem(self, goal: str, name: str) -> tuple[Domain, Problem]:
        """Return the domain and the problem of a goal, with the filters of the goal applied.

        :param name: the name of the returned problem.
        :raises PddlError: if the goal is unknown.
        """
        managed_goal, domain = self.find_goal(goal), self.domain

        def is_ground_kept(ground: Ground) -> bool:
            fluent_name, arguments = ground
            return _is_kept(fluent_name, managed_goal.kept_fluents) and all(
                _is_kept(argument, managed_goal.kept_objects) for argument in arguments
            )

        if managed_goal.kept_actions:
            # the changed domain has no source text, so planners get a printed text of the kept actions
            domain = domain.changed(
                actions=tuple(action for action in domain.actions if action.name in managed_goal.kept_actions)
            )
        return domain, problem_of_facts(
            domain,
            [
                (object_name, type_name)
                for object_name, type_name in self.objects.items()
                if _is_kept(object_name, managed_goal.kept_objects)
            ],
            [fluent for fluent in self.fluents if is_ground_kept(fluent)],
            And(tuple(managed_goal.formulas)),
            re.sub(r"\W", "_", name) or "problem",
            [(ground, value) for ground, value in self.functions.items() if is_ground_kept(ground)],
        )


def _is_kept(name: str, kept_names: tuple[str, ...]) -> bool:
    return not kept_names or name in kept_names


def _declare_requirements(text: str) -> str:
    """Return a domain without comments, in lower case, that declares :data:`_REQUIREMENTS`."""
    text = _REQUIREMENTS_SECTION.sub("", blank_comments(text).lower())
    return _DOMAIN_HEAD.sub(lambda head: f"{head[0]} (:requirements {_REQUIREMENTS})", text, count=1)


def _list_argument_names(terms: Sequence[Term], bindings: Binding = EMPTY_BINDING) -> tuple[str, ...]:
    """Return the names of the objects that terms stand for.

    A variable without a value has its own name instead, a function term an empty name.
    """
    return tuple(
        bindings.get(term.name, term.name) if isinstance(term, Variable) else getattr(term, "name", "")
        for term in terms
    )


def _find_conjuncts(formula: Formula | None, time_point: str = "START") -> Iterator[tuple[str, Formula]]:
    """Yield the formulas of a conjunction, each after its time point: START, END or ALL."""
    match formula:
        case None:
            return
        case And(parts=formulas):
            for conjunct in formulas:
                yield from _find_conjuncts(conjunct, time_point)
        case Timed(when=when, part=timed):
            yield from _find_conjuncts(timed, _TIME_POINTS.get(when, "ALL"))
        case _:
            yield time_point, formula


def _format_condition(formula: Formula, bindings: dict[str, str]) -> str:
    """Return a fluent or its negation in unified-planning's notation, and any other condition in PDDL."""
    match formula:
        case Atom(predicate=name, arguments=terms):
            arguments = ", ".join(_list_argument_names(terms, bindings))
            return f"{name}({arguments})" if arguments else name
        case Not(part=negated):
            return f"(not {_format_condition(negated, bindings)})"
        case _:
            return format_formula(formula)
