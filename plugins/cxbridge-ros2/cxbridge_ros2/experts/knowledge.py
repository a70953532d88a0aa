"""The knowledge about a planning problem, and the changes that PlanSys2's problem expert permits.

:class:`ProblemExpert` has the rules for changes: each name must exist in the domain or in the problem, and
the knowledge about an instance is removed with the instance. Subclasses of :class:`Knowledge` store the
knowledge in memory or as facts. A :class:`Ground` is a predicate or a function with its arguments. Source:
the class ProblemExpert of PlanSys2, and its node.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.pddl.ast import (
    ROOT_TYPE,
    And,
    Atom,
    Constant,
    Domain,
    Formula,
    FunctionTerm,
    Ground,
    Problem,
    TermComparison,
    TypedNames,
    make_ground,
    names_of,
    pairs_of,
)
from cxbridge.executive.pddl.parser import parse_formula, parse_problem
from cxbridge.executive.pddl.printer import format_formula
from cxbridge.executive.pddl.problems import problem_of_facts
from cxbridge.executive.pddl.semantics import DomainChecker
from cxbridge.executive.pddl.types import TypeHierarchy
from cxbridge.executive.problem.truth import KnownState

# Wider than the names of PDDL, but without the spaces, brackets and quotes that would break the text of a
# problem.
_NAME_PATTERN: Final = re.compile(r"\w[\w.:+-]*")
_ANY_NUMBER: Final = Constant("0")  # only the names in a formula are checked
_WORD_PATTERN: Final = re.compile(r"[^\s()]+")


def split_words(text: str) -> list[str]:
    """Return the words between the brackets of a PDDL text: names, variables, numbers and operators."""
    return _WORD_PATTERN.findall(text)


def format_ground(ground: Ground) -> str:
    """Return a predicate or a function in PDDL."""
    name, arguments = ground
    return f"({' '.join((name, *arguments))})"


def _raise_mistake(mistake: PddlError) -> None:
    """Raise a mistake that is a warning in PDDL files, so that clients get the reason."""
    raise mistake


class Knowledge(ABC):
    """Stores instances, predicates, functions and the goal, without checks."""

    @property
    @abstractmethod
    def instances(self) -> Mapping[str, str]:
        """The types of the instances, by name."""

    @property
    @abstractmethod
    def predicates(self) -> Sequence[Ground]:
        """The true predicates."""

    @property
    @abstractmethod
    def functions(self) -> Mapping[Ground, float]:
        """The values of the functions that have a value."""

    @property
    @abstractmethod
    def goal(self) -> str:
        """The formula of the goal; may be empty."""

    @abstractmethod
    def put_instance(self, name: str, type_name: str) -> None:
        """Add an instance that is not stored yet."""

    @abstractmethod
    def put_predicate(self, ground: Ground) -> None:
        """Add a predicate that is not stored yet."""

    @abstractmethod
    def put_function(self, ground: Ground, value: float) -> None:
        """Set the value of a function."""

    @abstractmethod
    def put_goal(self, formula: str) -> None:
        """Set the goal; an empty text removes the goal."""

    @abstractmethod
    def drop_instance(self, name: str) -> None:
        """Remove a stored instance."""

    @abstractmethod
    def drop_predicate(self, ground: Ground) -> None:
        """Remove a stored predicate."""

    @abstractmethod
    def drop_function(self, ground: Ground) -> None:
        """Remove a stored function."""


@dataclass(slots=True)
class MemoryKnowledge(Knowledge):
    """Stores the knowledge in memory."""

    instances: dict[str, str] = field(default_factory=dict)
    predicates: list[Ground] = field(default_factory=list)
    functions: dict[Ground, float] = field(default_factory=dict)
    goal: str = ""

    def put_instance(self, name: str, type_name: str) -> None:
        self.instances[name] = type_name

    def put_predicate(self, ground: Ground) -> None:
        self.predicates.append(ground)

    def put_function(self, ground: Ground, value: float) -> None:
        self.functions[ground] = value

    def put_goal(self, formula: str) -> None:
        self.goal = formula

    def drop_instance(self, name: str) -> None:
        del self.instances[name]

    def drop_predicate(self, ground: Ground) -> None:
        self.predicates.remove(ground)

    def drop_function(self, ground: Ground) -> None:
        del self.functions[ground]


class ProblemExpert:
    """Checks changes of the knowledge against the domain.

    :param find_domain: returns the domain, or None. Without a domain, each type and predicate is accepted.
    """

    def __init__(self, knowledge: Knowledge, find_domain: Callable[[], Domain | None]) -> None:
        self.knowledge = knowledge
        self._find_domain = find_domain

    @property
    def domain(self) -> Domain:
        """The domain.

        :raises PddlError: if there is no domain.
        """
        domain = self._find_domain()
        if domain is None:
            raise PddlError("there is no domain")
        return domain

    @property
    def instances(self) -> Mapping[str, str]:
        """The types of instances and of the domain's constants, by name."""
        domain = self._find_domain()
        constants = () if domain is None else pairs_of(domain.constants)
        return {**{name: type_name or ROOT_TYPE for name, type_name in constants}, **self.knowledge.instances}

    # --- instances

    def add_instance(self, name: str, type_name: str) -> None:
        """Add an instance, unless it exists with this type.

        :raises PddlError: if the name is invalid, the instance exists with another type, or the type is
            unknown.
        """
        if _NAME_PATTERN.fullmatch(name) is None:
            raise PddlError(f"'{name}' is not a valid name")
        domain = self._find_domain()
        if domain is not None and type_name not in (ROOT_TYPE, *names_of(domain.types)):
            raise PddlError(f"the domain has no type '{type_name}'")
        self._check_type(name, type_name)
        if name not in self.instances:
            self.knowledge.put_instance(name, type_name)

    def _check_type(self, name: str, type_name: str) -> None:
        known_type = self.instances.get(name)
        if known_type not in (None, type_name):
            raise PddlError(f"'{name}' already has the type {known_type}")

    def remove_instance(self, name: str) -> None:
        """Remove an instance, and all predicates, functions and parts of the goal that name the instance.

        :raises PddlError: if there is no such instance, or rules have set an invalid goal.
        """
        if name not in self.knowledge.instances:
            qualifier = "a constant of the domain, " if name in self.instances else ""
            raise PddlError(f"'{name}' is {qualifier}not an instance")
        for predicate in _select_grounds(self.knowledge.predicates, name):
            self.knowledge.drop_predicate(predicate)
        for function in _select_grounds(self.knowledge.functions, name):
            self.knowledge.drop_function(function)
        if name in split_words(self.knowledge.goal):
            self.knowledge.put_goal(_remove_from_goal(self.knowledge.goal, name))
        self.knowledge.drop_instance(name)

    # --- predicates and functions

    def add_predicate(self, ground: Ground) -> None:
        """Make a predicate true.

        :raises PddlError: if the predicate or an argument is unknown.
        """
        if ground not in self.knowledge.predicates:
            self.check_names(_make_atom(*ground))
            self.knowledge.put_predicate(ground)

    def remove_predicate(self, ground: Ground) -> None:
        """Make a predicate false.

        :raises PddlError: if the predicate or an argument is unknown.
        """
        self.check_names(_make_atom(*ground))
        if ground in self.knowledge.predicates:
            self.knowledge.drop_predicate(ground)

    def add_function(self, ground: Ground, value: float) -> None:
        """Set the value of a function.

        :raises PddlError: if the function or an argument is unknown.
        """
        self.check_names(_make_comparison(*ground))
        self.knowledge.put_function(ground, float(value))

    def update_function(self, ground: Ground, value: float) -> None:
        """Change the value of a function.

        :raises PddlError: if the function has no value yet, or a name is unknown.
        """
        if ground not in self.knowledge.functions:
            raise PddlError(f"{format_ground(ground)} has no value")
        self.add_function(ground, value)

    def remove_function(self, ground: Ground) -> None:
        """Remove the value of a function.

        :raises PddlError: if the function or an argument is unknown.
        """
        self.check_names(_make_comparison(*ground))
        if ground in self.knowledge.functions:
            self.knowledge.drop_function(ground)

    def check_names(self, formula: Formula) -> None:
        """Check a formula's names against domain and instances; without a domain, accept all names.

        :raises PddlError: for the first mistake.
        """
        domain = self._find_domain()
        if domain is not None:
            # the checker knows only constants, so each instance is passed as a constant
            constants = set(names_of(domain.constants))
            groups = tuple(
                TypedNames((name,), (type_name,))
                for name, type_name in self.knowledge.instances.items()
                if name not in constants
            )
            DomainChecker(domain.changed(constants=domain.constants + groups)).check_formula(formula)

    # --- goals and problems

    @property
    def goal(self) -> Formula | None:
        """The goal; None without a goal.

        :raises PddlError: if rules have set an invalid goal.
        """
        return parse_formula(self.knowledge.goal) if self.knowledge.goal else None

    def set_goal(self, goal: Formula) -> None:
        """Set the goal.

        :raises PddlError: if a name in the goal is unknown.
        """
        self.check_names(goal)
        self.knowledge.put_goal(format_formula(goal))

    def is_satisfied(self, goal: Formula) -> bool:
        """Return whether a formula is true now.

        :raises PddlError: if a name in the formula is unknown, or the formula has a quantifier and there is
            no domain.
        """
        self.check_names(goal)
        predicates, functions = set(self.knowledge.predicates), self.knowledge.functions
        return goal.holds(KnownState(predicates, functions, self._find_instances))

    def _find_instances(self, types: tuple[str, ...]) -> list[str]:
        """Return the instances of some types and their subtypes; without types, all instances."""
        hierarchy = TypeHierarchy(self.domain.types)
        return [
            name
            for name, type_name in self.instances.items()
            if not hierarchy.supertypes(type_name).isdisjoint(types or (ROOT_TYPE,))
        ]

    def make_problem(self) -> Problem:
        """Return the knowledge as a problem.

        :raises PddlError: if there is no domain, or rules have made the knowledge invalid.
        """
        domain, knowledge = self.domain, self.knowledge
        declared_predicates = {predicate.name for predicate in domain.predicates}
        problem = problem_of_facts(
            domain,
            knowledge.instances.items(),
            # rules may assert facts whose predicates the domain lacks: planners would reject the problem
            [(name, arguments) for name, arguments in knowledge.predicates if name in declared_predicates],
            self.goal or And(()),
            numbers=knowledge.functions.items(),
        )
        return problem.changed(name="problem_1")  # PlanSys2's name for each problem

    def add_problem(self, text: str) -> None:
        """Add the contents of a problem; its goal replaces the current goal.

        :raises PddlError: if there is no domain, the problem does not fit the domain, or an instance exists
            with another type; nothing is added then.
        """
        problem = parse_problem(text, self.domain, warn=_raise_mistake)
        objects = {name: type_name or ROOT_TYPE for name, type_name in pairs_of(problem.objects)}
        for name, type_name in objects.items():  # all checks before the first change
            self._check_type(name, type_name)
        for name, type_name in objects.items():
            self.add_instance(name, type_name)
        for atom in problem.init:
            self.add_predicate(make_ground(atom.predicate, atom))
        for call, value in problem.numbers:
            self.add_function(make_ground(call.function, call), value)
        self.set_goal(problem.goal)

    def clear(self) -> None:
        self.knowledge.put_goal("")
        for function in list(self.knowledge.functions):
            self.knowledge.drop_function(function)
        for predicate in list(self.knowledge.predicates):
            self.knowledge.drop_predicate(predicate)
        for name in list(self.knowledge.instances):
            self.knowledge.drop_instance(name)


def find_subtypes(domain: Domain, type_name: str) -> list[str]:
    """Return the descendants of a type in the order of their declarations."""
    hierarchy, names = TypeHierarchy(domain.types), dict.fromkeys(names_of(domain.types))
    return [name for name in names if name != type_name and type_name in hierarchy.supertypes(name)]


def _select_grounds(grounds: Iterable[Ground], name: str) -> list[Ground]:
    """Return the predicates or functions that have an instance as argument."""
    return [(symbol, arguments) for symbol, arguments in grounds if name in arguments]


def _make_atom(name: str, arguments: tuple[str, ...]) -> Atom:
    return Atom(name, tuple(map(Constant, arguments)))


def _make_comparison(name: str, arguments: tuple[str, ...]) -> TermComparison:
    """Return a formula that compares a function with a number, for the check of its names."""
    return TermComparison("=", FunctionTerm(name, tuple(map(Constant, arguments))), _ANY_NUMBER)


def _remove_from_goal(goal: str, name: str) -> str:
    """Return a goal without its conjuncts that name an instance; empty if no conjunct remains."""
    formula = parse_formula(goal)
    conjuncts = formula.parts if isinstance(formula, And) else (formula,)
    remaining_conjuncts = tuple(part for part in conjuncts if name not in split_words(format_formula(part)))
    return format_formula(And(remaining_conjuncts)) if remaining_conjuncts else ""
