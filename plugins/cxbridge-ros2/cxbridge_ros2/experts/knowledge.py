"""The knowledge about a problem, and its changes: the rules of PlanSys2's problem expert.

Where it is kept is another matter: in memory, or as facts of an environment. Source: PlanSys2's ProblemExpert
and its node.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
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
    names_of,
    pairs_of,
)
from cxbridge.executive.pddl.parser import parse_formula, parse_problem
from cxbridge.executive.pddl.printer import format_formula
from cxbridge.executive.pddl.problems import problem_of_facts
from cxbridge.executive.pddl.semantics import DomainChecker
from cxbridge.executive.problem.truth import KnownState

_NAME: Final = re.compile(r"\w[\w.:+-]*")
_ZERO: Final = Constant("0")
_WORDS: Final = re.compile(r"[^\s()]+")


def words_of(text: str) -> list[str]:
    """Return the words of a text of PDDL."""
    return _WORDS.findall(text)


def _refuse(mistake: PddlError) -> None:
    """Refuse a problem for a mistake that planners tolerate: clients of experts get the reason."""
    raise mistake


class Knowledge(ABC):
    """Where instances, predicates, functions and the goal are kept."""

    @property
    @abstractmethod
    def instances(self) -> Mapping[str, str]:
        """The type of each instance."""

    @property
    @abstractmethod
    def predicates(self) -> Sequence[Ground]:
        """The true predicates."""

    @property
    @abstractmethod
    def functions(self) -> Mapping[Ground, float]:
        """The value of each function that has one."""

    @property
    @abstractmethod
    def goal(self) -> str:
        """The formula of the goal; empty when there is none."""

    @abstractmethod
    def put_instance(self, name: str, kind: str) -> None:
        """Add a new instance."""

    @abstractmethod
    def put_predicate(self, ground: Ground) -> None:
        """Add a new predicate."""

    @abstractmethod
    def put_function(self, ground: Ground, value: float) -> None:
        """Give a function a value, in place of the one that it has."""

    @abstractmethod
    def put_goal(self, formula: str) -> None:
        """Set the goal; empty: none."""

    @abstractmethod
    def drop_instance(self, name: str) -> None:
        """Forget an instance."""

    @abstractmethod
    def drop_predicate(self, ground: Ground) -> None:
        """Remove a predicate."""

    @abstractmethod
    def drop_function(self, ground: Ground) -> None:
        """Forget the value of a function."""


@dataclass(slots=True)
class MemoryKnowledge(Knowledge):
    """Keeps it in memory."""

    instances: dict[str, str] = field(default_factory=dict)
    predicates: list[Ground] = field(default_factory=list)
    functions: dict[Ground, float] = field(default_factory=dict)
    goal: str = ""

    def put_instance(self, name: str, kind: str) -> None:
        """Note an instance."""
        self.instances[name] = kind

    def put_predicate(self, ground: Ground) -> None:
        """Add a predicate."""
        self.predicates.append(ground)

    def put_function(self, ground: Ground, value: float) -> None:
        """Give a function a value."""
        self.functions[ground] = value

    def put_goal(self, formula: str) -> None:
        """Want something."""
        self.goal = formula

    def drop_instance(self, name: str) -> None:
        """Forget an instance."""
        del self.instances[name]

    def drop_predicate(self, ground: Ground) -> None:
        """Remove a predicate."""
        self.predicates.remove(ground)

    def drop_function(self, ground: Ground) -> None:
        """Forget the value of a function."""
        del self.functions[ground]


class ProblemExpert:
    """Restricts knowledge to the names of the domain.

    :param knowledge: the knowledge to change.
    :param domain_of: returns the domain; None: there is none, and any type and predicate is taken.
    """

    def __init__(self, knowledge: Knowledge, domain_of: Callable[[], Domain | None]) -> None:
        self.knowledge = knowledge
        self._domain_of = domain_of

    @property
    def domain(self) -> Domain:
        """The domain.

        :raises PddlError: when there is none.
        """
        domain = self._domain_of()
        if domain is None:
            raise PddlError("there is no domain")
        return domain

    @property
    def instances(self) -> Mapping[str, str]:
        """The type of each instance, then of each constant of the domain."""
        domain = self._domain_of()
        constants = () if domain is None else pairs_of(domain.constants)
        return {**{name: kind or ROOT_TYPE for name, kind in constants}, **self.knowledge.instances}

    # ---- instances

    def add_instance(self, name: str, kind: str) -> None:
        """Add an instance; an existing one of this type stays.

        :raises PddlError: when it exists with another type, or there is no such type.
        """
        if _NAME.fullmatch(name) is None:
            raise PddlError(f"'{name}' is no name")
        domain = self._domain_of()
        if domain is not None and kind not in (ROOT_TYPE, *names_of(domain.types)):
            raise PddlError(f"the domain has no such type: '{kind}'")
        there = self.instances.get(name)
        if there not in (None, kind):
            raise PddlError(f"'{name}' is a {there} already")
        if there is None:
            self.knowledge.put_instance(name, kind)

    def remove_instance(self, name: str) -> None:
        """Remove an instance, with its predicates and its part of the goal.

        :raises PddlError: when there is none of that name.
        """
        if name not in self.knowledge.instances:
            constant = "a constant of the domain" if name in self.instances else "no instance"
            raise PddlError(f"'{name}' is {constant}")
        for ground in [each for each in self.knowledge.predicates if name in each[1]]:
            self.knowledge.drop_predicate(ground)
        for ground in [each for each in self.knowledge.functions if name in each[1]]:
            self.knowledge.drop_function(ground)
        if name in words_of(self.knowledge.goal):
            self.knowledge.put_goal(_without(self.knowledge.goal, name))
        self.knowledge.drop_instance(name)

    # ---- predicates and functions

    def add_predicate(self, ground: Ground) -> None:
        """Make something true.

        :raises PddlError: when the domain has no words for it, or an argument is not an instance.
        """
        if ground not in self.knowledge.predicates:
            self.check(_atom(ground))
            self.knowledge.put_predicate(ground)

    def remove_predicate(self, ground: Ground) -> None:
        """Make something false.

        :raises PddlError: when the domain has no words for it, or an argument is not an instance.
        """
        self.check(_atom(ground))
        if ground in self.knowledge.predicates:
            self.knowledge.drop_predicate(ground)

    def add_function(self, ground: Ground, value: float) -> None:
        """Give a function a value.

        :raises PddlError: when the domain has no such function, or an argument is not an instance.
        """
        self.check(_comparison(ground))
        self.knowledge.put_function(ground, float(value))

    def update_function(self, ground: Ground, value: float) -> None:
        """Give a function another value.

        :raises PddlError: when it has none yet.
        """
        if ground not in self.knowledge.functions:
            raise PddlError(f"({' '.join((ground[0], *ground[1]))}) has no value")
        self.add_function(ground, value)

    def remove_function(self, ground: Ground) -> None:
        """Take the value of a function away.

        :raises PddlError: when the domain has no such function, or an argument is not an instance.
        """
        self.check(_comparison(ground))
        if ground in self.knowledge.functions:
            self.knowledge.drop_function(ground)

    def check(self, formula: Formula) -> None:
        """Check that the domain has words for a formula, and its constants are instances.

        :raises PddlError: for the first mistake.
        """
        domain = self._domain_of()
        if domain is not None:
            constants = set(names_of(domain.constants))
            others = {name: kind for name, kind in self.knowledge.instances.items() if name not in constants}
            groups = tuple(TypedNames((name,), (kind,)) for name, kind in others.items())
            DomainChecker(domain.changed(constants=domain.constants + groups)).check_formula(formula)

    # ---- goals and problems

    @property
    def goal(self) -> Formula | None:
        """The goal; None when there is none.

        :raises PddlError: when rules have set an invalid goal.
        """
        return parse_formula(self.knowledge.goal) if self.knowledge.goal else None

    def set_goal(self, goal: Formula) -> None:
        """Want something.

        :raises PddlError: when the domain has no words for it, or a constant is not an instance.
        """
        self.check(goal)
        self.knowledge.put_goal(format_formula(goal))

    def is_satisfied(self, goal: Formula) -> bool:
        """Return whether a formula is true now.

        :raises PddlError: when the domain has no words for it, or a constant is not an instance.
        """
        self.check(goal)
        return goal.holds(KnownState(set(self.knowledge.predicates), self.knowledge.functions, self._is_a))

    def _is_a(self, types: tuple[str, ...]) -> list[str]:
        """Return the instances of some types; of no types: all."""
        wanted = {each for kind in types for each in (kind, *subtypes(self.domain, kind))}
        kinds = self.instances.items()
        return [name for name, kind in kinds if not wanted or ROOT_TYPE in wanted or kind in wanted]

    def problem(self) -> Problem:
        """Return it all as a problem.

        :raises PddlError: when rules have made the knowledge invalid.
        """
        domain, knowledge = self.domain, self.knowledge
        predicates = {each.name for each in domain.predicates}
        found = problem_of_facts(
            domain,
            knowledge.instances.items(),
            [each for each in knowledge.predicates if each[0] in predicates],
            self.goal or And(()),
            numbers=knowledge.functions.items(),
        )
        return found.changed(name="problem_1")

    def add_problem(self, text: str) -> None:
        """Add the contents of a problem; its goal replaces the present one.

        :raises PddlError: when it is none of the domain, or an instance exists with another type; nothing
            is added then.
        """
        problem = parse_problem(text, self.domain, warn=_refuse)
        objects = dict(pairs_of(problem.objects))
        for name, kind in objects.items():
            there = self.instances.get(name)
            if there not in (None, kind or ROOT_TYPE):
                raise PddlError(f"'{name}' is a {there} already")
        for name, kind in objects.items():
            self.add_instance(name, kind or ROOT_TYPE)
        for atom in problem.init:
            self.add_predicate(ground_of(atom.predicate, atom))
        for call, value in problem.numbers:
            self.add_function(ground_of(call.function, call), value)
        self.set_goal(problem.goal)

    def clear(self) -> None:
        """Forget everything."""
        self.knowledge.put_goal("")
        for function in list(self.knowledge.functions):
            self.knowledge.drop_function(function)
        for predicate in list(self.knowledge.predicates):
            self.knowledge.drop_predicate(predicate)
        for name in list(self.knowledge.instances):
            self.knowledge.drop_instance(name)


def subtypes(domain: Domain, kind: str) -> list[str]:
    """Return the types that descend from a type, without itself."""
    found: list[str] = []
    waiting = [kind]
    while waiting:
        above = waiting.pop(0)
        below = [name for name, parent in pairs_of(domain.types) if (parent or ROOT_TYPE) == above]
        new = [name for name in below if name not in (*found, kind)]
        found += new
        waiting += new
    return found


def ground_of(name: str, term: Atom | FunctionTerm) -> Ground:
    """Return an atom, or the term of a function, whose arguments are constants."""
    return name, tuple(each.name for each in term.arguments if isinstance(each, Constant))


def _atom(ground: Ground) -> Atom:
    return Atom(ground[0], tuple(map(Constant, ground[1])))


def _comparison(ground: Ground) -> TermComparison:
    return TermComparison("=", FunctionTerm(ground[0], tuple(map(Constant, ground[1]))), _ZERO)


def _without(goal: str, name: str) -> str:
    """Return the rest of a goal without the parts about an instance."""
    formula = parse_formula(goal)
    parts = formula.parts if isinstance(formula, And) else (formula,)
    left = tuple(part for part in parts if name not in words_of(format_formula(part)))
    return format_formula(And(left)) if left else ""
