"""The abstract syntax of PDDL domains and formulas, as frozen values.

Nodes compare by what they say: positions do not count. More can be said here than the CLIPS Executive has
facts for (quantifiers, conditional effects, numbers): planners understand it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache
from operator import attrgetter
from typing import Any, ClassVar, Final, NamedTuple

from msgspec import Struct
from msgspec.structs import replace


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


class FormulaNode(PddlNode, frozen=True):
    """A formula, the only tree of conditions and effects: whoever goes through it uses walk or map.

    :cvar PARTS: the fields that hold formulas, one or a tuple of them.
    :cvar TERMS: the fields that hold terms.
    """

    PARTS: ClassVar[tuple[str, ...]] = ()
    TERMS: ClassVar[tuple[str, ...]] = ()

    @property
    def children(self) -> tuple[Formula, ...]:
        """The formulas that this one is made of, in the order of the text."""
        return tuple(_values(self, self.PARTS))

    @property
    def terms(self) -> tuple[Term, ...]:
        """The terms of this formula itself; those of its children are not among them."""
        return tuple(_values(self, self.TERMS))

    def walk(self) -> Iterator[Formula]:
        """Yield this formula and all below it, each before its children."""
        yield self  # type: ignore[misc]  # Formula is all subclasses
        for child in self.children:
            yield from child.walk()

    def map(self, change: Callable[[Formula], Formula]) -> Formula:
        """Return the formula with each formula in it changed, children first."""
        fields = {name: _mapped(getattr(self, name), lambda part: part.map(change)) for name in self.PARTS}
        return change(replace(self, **fields) if fields else self)  # type: ignore[arg-type]

    def map_terms(self, change: Callable[[Term], Term]) -> Formula:
        """Return the formula with each term in it changed, also those within terms, which come first."""

        def changed(term: Term) -> Term:
            if isinstance(term, FunctionTerm):
                term = replace(term, arguments=tuple(map(changed, term.arguments)))
            return change(term)

        def with_terms(formula: Formula) -> Formula:
            fields = {name: _mapped(getattr(formula, name), changed) for name in formula.TERMS}
            return replace(formula, **fields) if fields else formula

        return self.map(with_terms)


def _values(node: FormulaNode, fields: tuple[str, ...]) -> Iterator[Any]:
    for name in fields:
        value = getattr(node, name)
        if isinstance(value, tuple):
            yield from value
        else:
            yield value


def _mapped(value: Any, change: Callable[[Any], Any]) -> Any:
    return tuple(map(change, value)) if isinstance(value, tuple) else change(value)


class Atom(FormulaNode, frozen=True):
    """A predicate with its arguments."""

    TERMS: ClassVar[tuple[str, ...]] = ("arguments",)

    predicate: str
    arguments: tuple[Term, ...]
    position: Position = Position()


class And(FormulaNode, frozen=True):
    """A conjunction; an empty one is true."""

    PARTS: ClassVar[tuple[str, ...]] = ("parts",)

    parts: tuple[Formula, ...]
    position: Position = Position()


class Or(FormulaNode, frozen=True):
    """A disjunction."""

    PARTS: ClassVar[tuple[str, ...]] = ("parts",)

    parts: tuple[Formula, ...]
    position: Position = Position()


class Not(FormulaNode, frozen=True):
    """A negation."""

    PARTS: ClassVar[tuple[str, ...]] = ("part",)

    part: Formula
    position: Position = Position()


class Imply(FormulaNode, frozen=True):
    """An implication."""

    PARTS: ClassVar[tuple[str, ...]] = ("condition", "consequence")

    condition: Formula
    consequence: Formula
    position: Position = Position()


class TermComparison(FormulaNode, frozen=True):
    """``=`` of two terms, or one of ``< > <= >=`` of two numbers."""

    TERMS: ClassVar[tuple[str, ...]] = ("left", "right")

    operator: str
    left: Term
    right: Term
    position: Position = Position()


class Timed(FormulaNode, frozen=True):
    """A formula at a time of a durative action: ``at start``, ``at end`` or ``over all``."""

    PARTS: ClassVar[tuple[str, ...]] = ("part",)

    when: str
    part: Formula
    position: Position = Position()


class Quantified(FormulaNode, frozen=True):
    """A formula ``exists`` or ``forall`` objects."""

    PARTS: ClassVar[tuple[str, ...]] = ("part",)

    quantifier: str
    variables: TypedList
    part: Formula
    position: Position = Position()


class When(FormulaNode, frozen=True):
    """A conditional effect."""

    PARTS: ClassVar[tuple[str, ...]] = ("condition", "effect")

    condition: Formula
    effect: Formula
    position: Position = Position()


class NumericChange(FormulaNode, frozen=True):
    """An effect on a number: increase, decrease, assign, scale-up or scale-down."""

    TERMS: ClassVar[tuple[str, ...]] = ("target", "amount")

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
