"""The abstract syntax of PDDL domains and formulas, as frozen values.

Nodes compare by what they say: positions do not count. More can be said here than the CLIPS Executive has
facts for (quantifiers, conditional effects, numbers): planners understand it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple


class Position(NamedTuple):
    """Line and column, both counted from 1."""

    line: int = 1
    column: int = 1


@dataclass(frozen=True, slots=True)
class TypedNames:
    """Names that share a type: ``a b - c``, or ``a b - (either c d)``.

    :param names: the names, variables without their question mark.
    :param types: the types; empty when none is given, several for ``either``.
    """

    names: tuple[str, ...]
    types: tuple[str, ...] = ()
    position: Position = field(default=Position(), compare=False, repr=False)


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


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable, without its question mark."""

    name: str
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Constant:
    """A constant or a number, as written."""

    name: str
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class FunctionTerm:
    """The value of a function or of an arithmetic operator: ``(distance ?a ?b)``, ``(+ (f) 3)``."""

    function: str
    arguments: tuple[Term, ...]
    position: Position = field(default=Position(), compare=False, repr=False)


Term = Variable | Constant | FunctionTerm


# ---- formulas


@dataclass(frozen=True, slots=True)
class Atom:
    """A predicate with its arguments."""

    predicate: str
    arguments: tuple[Term, ...]
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class And:
    """A conjunction; an empty one is true."""

    parts: tuple[Formula, ...]
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Or:
    """A disjunction."""

    parts: tuple[Formula, ...]
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Not:
    """A negation."""

    part: Formula
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Imply:
    """An implication."""

    condition: Formula
    consequence: Formula
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class TermComparison:
    """``=`` of two terms, or one of ``< > <= >=`` of two numbers."""

    operator: str
    left: Term
    right: Term
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Timed:
    """A formula at a time of a durative action: ``at start``, ``at end`` or ``over all``."""

    when: str
    part: Formula
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Quantified:
    """A formula ``exists`` or ``forall`` objects."""

    quantifier: str
    variables: TypedList
    part: Formula
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class When:
    """A conditional effect."""

    condition: Formula
    effect: Formula
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class NumericChange:
    """An effect on a number: increase, decrease, assign, scale-up or scale-down."""

    operator: str
    target: Term
    amount: Term
    position: Position = field(default=Position(), compare=False, repr=False)


Formula = Atom | And | Or | Not | Imply | TermComparison | Timed | Quantified | When | NumericChange


# ---- domains


@dataclass(frozen=True, slots=True)
class Predicate:
    """The declaration of a predicate."""

    name: str
    parameters: TypedList
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Function:
    """The declaration of a numeric function."""

    name: str
    parameters: TypedList
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class ActionSchema:
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
    position: Position = field(default=Position(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Domain:
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
    file: str = field(default="", compare=False)
