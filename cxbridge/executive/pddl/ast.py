"""The abstract syntax of PDDL domains and formulas, as frozen values.

Nodes compare by what they say: positions do not count. More can be said here than the CLIPS Executive has
facts for (quantifiers, conditional effects, numbers): planners understand it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from operator import attrgetter
from typing import Any, Final, NamedTuple

from msgspec import Struct


class Position(NamedTuple):
    """Line and column, both counted from 1."""

    line: int = 1
    column: int = 1


_UNSAID: Final = ("position", "file")
"""Where a node was read: it does not count when nodes are compared."""


@cache
def _compared_fields(node_class: type[PddlNode]) -> attrgetter[Any]:
    """Return what reads the fields that nodes of this class are compared by."""
    return attrgetter(*(name for name in node_class.__struct_fields__ if name not in _UNSAID))


class PddlNode(Struct, frozen=True):
    """Nodes are equal when they say the same, wherever they were read."""

    def __eq__(self, other: object) -> bool:
        said = _compared_fields(type(self))
        return type(self) is type(other) and bool(said(self) == said(other))

    def __hash__(self) -> int:
        return hash(_compared_fields(type(self))(self))


class TypedNames(PddlNode, frozen=True):
    """Names that share a type: ``a b - c``, or ``a b - (either c d)``.

    :param names: the names, variables without their question mark.
    :param types: the types; empty when none is given, several for ``either``.
    """

    names: tuple[str, ...]
    types: tuple[str, ...] = ()
    position: Position = Position()


TypedList = tuple[TypedNames, ...]


def names_of(typed: TypedList) -> tuple[str, ...]:
    """Return the names of a typed list, each once for each time it is written."""
    return tuple(name for group in typed for name in group.names)


def pairs_of(typed: TypedList) -> Iterator[tuple[str, str]]:
    """Yield name and type; for each type of an ``either`` all names of its group; an absent type is empty."""
    for group in typed:
        for type_ in group.types or ("",):
            for name in group.names:
                yield name, type_


# ---- terms


class Variable(PddlNode, frozen=True):
    """A variable, without its question mark."""

    name: str
    position: Position = Position()


class Constant(PddlNode, frozen=True):
    """A constant or a number, as written."""

    name: str
    position: Position = Position()


_NUMBER: Final = re.compile(r"[+-]?(\d+(?:\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def number_of(text: str) -> float | None:
    """Return the number that a word of PDDL writes; None for a name, also for ``inf`` and ``nan``."""
    return float(text) if _NUMBER.fullmatch(text) else None


class FunctionTerm(PddlNode, frozen=True):
    """The value of a function or of an arithmetic operator: ``(distance ?a ?b)``, ``(+ (f) 3)``."""

    function: str
    arguments: tuple[Term, ...]
    position: Position = Position()


Term = Variable | Constant | FunctionTerm


# ---- formulas


class Atom(PddlNode, frozen=True):
    """A predicate with its arguments."""

    predicate: str
    arguments: tuple[Term, ...]
    position: Position = Position()


class And(PddlNode, frozen=True):
    """A conjunction; an empty one is true."""

    parts: tuple[Formula, ...]
    position: Position = Position()


class Or(PddlNode, frozen=True):
    """A disjunction."""

    parts: tuple[Formula, ...]
    position: Position = Position()


class Not(PddlNode, frozen=True):
    """A negation."""

    part: Formula
    position: Position = Position()


class Imply(PddlNode, frozen=True):
    """An implication."""

    condition: Formula
    consequence: Formula
    position: Position = Position()


class TermComparison(PddlNode, frozen=True):
    """``=`` of two terms, or one of ``< > <= >=`` of two numbers."""

    operator: str
    left: Term
    right: Term
    position: Position = Position()


class Timed(PddlNode, frozen=True):
    """A formula at a time of a durative action: ``at start``, ``at end`` or ``over all``."""

    when: str
    part: Formula
    position: Position = Position()


class Quantified(PddlNode, frozen=True):
    """A formula ``exists`` or ``forall`` objects."""

    quantifier: str
    variables: TypedList
    part: Formula
    position: Position = Position()


class When(PddlNode, frozen=True):
    """A conditional effect."""

    condition: Formula
    effect: Formula
    position: Position = Position()


class NumericChange(PddlNode, frozen=True):
    """An effect on a number: increase, decrease, assign, scale-up or scale-down."""

    operator: str
    target: Term
    amount: Term
    position: Position = Position()


Formula = Atom | And | Or | Not | Imply | TermComparison | Timed | Quantified | When | NumericChange


# ---- domains


class Predicate(PddlNode, frozen=True):
    """The declaration of a predicate."""

    name: str
    parameters: TypedList
    position: Position = Position()


class Function(PddlNode, frozen=True):
    """The declaration of a numeric function."""

    name: str
    parameters: TypedList
    position: Position = Position()


class ActionSchema(PddlNode, frozen=True):
    """An action.

    :param durative: whether it is written ``:durative-action``.
    :param duration: the constraint on ``?duration``, e.g. ``(= ?duration 5)``.
    :param condition: the precondition or condition; None when there is none.
    :param effect: the effect; None when there is none.
    :param conditional_breakup: Fawkes' own section of that name.
    :param temporal_breakup: Fawkes' own section of that name.
    """

    name: str
    parameters: TypedList = ()
    condition: Formula | None = None
    effect: Formula | None = None
    durative: bool = False
    duration: Formula | None = None
    conditional_breakup: Formula | None = None
    temporal_breakup: Formula | None = None
    position: Position = Position()


class Domain(PddlNode, frozen=True):
    """A planning domain.

    :param requirements: the requirements, without their colon.
    :param file: the file it was read from; empty when none.
    """

    name: str
    requirements: tuple[str, ...] = ()
    types: TypedList = ()
    constants: TypedList = ()
    predicates: tuple[Predicate, ...] = ()
    functions: tuple[Function, ...] = ()
    actions: tuple[ActionSchema, ...] = ()
    file: str = ""
