"""The abstract syntax of PDDL domains, problems and formulas, as frozen values.

Nodes compare by content: positions do not count. The tree can hold more than the CLIPS Executive has
facts for (quantifiers, conditional effects, numbers): planners understand it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from operator import attrgetter, is_
from types import MappingProxyType
from typing import Any, ClassVar, Final, NamedTuple, Protocol

from msgspec import Struct, field
from msgspec.structs import replace


class Position(NamedTuple):
    """Line and column, both counted from 1."""

    line: int = 1
    column: int = 1


# Where a node was read, and from which text: that does not count when nodes are compared.
_UNSAID: Final = ("position", "file", "text")


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

ROOT_TYPE: Final = "object"
"""The type above all types."""


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


Ground = tuple[str, tuple[str, ...]]
"""A predicate or function with its objects."""

Bound = Mapping[str, str]
"""The objects that variables stand for."""

NOTHING_BOUND: Final[Bound] = MappingProxyType({})


class State(Protocol):
    """The facts of a moment, as conditions read them."""

    def has(self, predicate: str, terms: tuple[Term, ...], bound: Bound) -> bool:
        """Whether the fact of a predicate is true."""

    def compares(self, operator: str, left: Term, right: Term, bound: Bound) -> bool:
        """Whether two terms compare so."""

    def bindings(self, variables: TypedList, bound: Bound) -> Iterator[Bound]:
        """Yield ``bound`` with a choice of objects for the variables, for each choice."""

    def look(self) -> None:
        """Count a formula that is looked at.

        :raises PddlError: when there are too many.
        """


class FormulaNode(PddlNode, frozen=True):
    """A formula, the one tree of conditions and effects, gone through with walk, map and holds.

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

    def holds(self, state: State, bound: Bound = NOTHING_BOUND) -> bool:
        """Return whether the condition is true in a state.

        :param bound: the objects that its free variables stand for.
        :raises PddlError: when quantified variables make too many cases.
        """
        state.look()
        return self._holds(state, bound)

    def _holds(self, state: State, bound: Bound) -> bool:  # noqa: ARG002 - for subclasses
        return False  # an effect, or a part of a durative action: no condition

    def map(self, change: Callable[[Formula], Formula]) -> Formula:
        """Return the formula with each formula in it changed, children first."""
        return change(_with_values(self, self.PARTS, lambda part: part.map(change)))

    def map_terms(self, change: Callable[[Term], Term]) -> Formula:
        """Return the formula with each term in it changed, also those within terms, which come first."""

        def changed(term: Term) -> Term:
            if isinstance(term, FunctionTerm):
                term = _with_values(term, ("arguments",), changed)
            return change(term)

        return self.map(lambda formula: _with_values(formula, formula.TERMS, changed))


def _with_values(node: Any, fields: tuple[str, ...], change: Callable[[Any], Any]) -> Any:
    """Return a node with the values of these fields changed; the node itself when that changes nothing."""
    different = {}
    for name in fields:
        old = getattr(node, name)
        new = tuple(map(change, old)) if isinstance(old, tuple) else change(old)
        is_same = all(map(is_, new, old)) if isinstance(old, tuple) else new is old
        if not is_same:
            different[name] = new
    return replace(node, **different) if different else node


def _values(node: FormulaNode, fields: tuple[str, ...]) -> Iterator[Any]:
    for name in fields:
        value = getattr(node, name)
        if isinstance(value, tuple):
            yield from value
        else:
            yield value


class Atom(FormulaNode, frozen=True):
    """A predicate with its arguments."""

    TERMS: ClassVar[tuple[str, ...]] = ("arguments",)

    predicate: str
    arguments: tuple[Term, ...]
    position: Position = Position()

    def _holds(self, state: State, bound: Bound) -> bool:
        return state.has(self.predicate, self.arguments, bound)


class And(FormulaNode, frozen=True):
    """A conjunction; an empty one is true."""

    PARTS: ClassVar[tuple[str, ...]] = ("parts",)

    parts: tuple[Formula, ...]
    position: Position = Position()

    def _holds(self, state: State, bound: Bound) -> bool:
        return all(part.holds(state, bound) for part in self.parts)


class Or(FormulaNode, frozen=True):
    """A disjunction."""

    PARTS: ClassVar[tuple[str, ...]] = ("parts",)

    parts: tuple[Formula, ...]
    position: Position = Position()

    def _holds(self, state: State, bound: Bound) -> bool:
        return any(part.holds(state, bound) for part in self.parts)


class Not(FormulaNode, frozen=True):
    """A negation."""

    PARTS: ClassVar[tuple[str, ...]] = ("part",)

    part: Formula
    position: Position = Position()

    def _holds(self, state: State, bound: Bound) -> bool:
        return not self.part.holds(state, bound)


class Imply(FormulaNode, frozen=True):
    """An implication."""

    PARTS: ClassVar[tuple[str, ...]] = ("condition", "consequence")

    condition: Formula
    consequence: Formula
    position: Position = Position()

    def _holds(self, state: State, bound: Bound) -> bool:
        return not self.condition.holds(state, bound) or self.consequence.holds(state, bound)


class TermComparison(FormulaNode, frozen=True):
    """``=`` of two terms, or one of ``< > <= >=`` of two numbers."""

    TERMS: ClassVar[tuple[str, ...]] = ("left", "right")

    operator: str
    left: Term
    right: Term
    position: Position = Position()

    def _holds(self, state: State, bound: Bound) -> bool:
        return state.compares(self.operator, self.left, self.right, bound)


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

    def _holds(self, state: State, bound: Bound) -> bool:
        some = any if self.quantifier == "exists" else all
        return some(self.part.holds(state, inner) for inner in state.bindings(self.variables, bound))


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
    :param text: the text it was read from, for planners that read PDDL themselves; empty when the domain was
        not read, or changed since.
    """

    name: str
    requirements: tuple[str, ...] = ()
    types: TypedList = ()
    constants: TypedList = ()
    predicates: tuple[Predicate, ...] = ()
    functions: tuple[Function, ...] = ()
    actions: tuple[ActionSchema, ...] = ()
    file: str = ""
    text: str = ""

    @property
    def is_typed(self) -> bool:
        """Whether anything in the domain has a type, or its requirements allow for types."""
        declared: tuple[Predicate | Function | ActionSchema, ...] = (
            *self.predicates,
            *self.functions,
            *self.actions,
        )
        lists = (self.types, self.constants, *(each.parameters for each in declared))
        return not TYPING.isdisjoint(self.requirements) or any(
            bool(group.types) for typed in lists for group in typed
        )

    def changed(self, **fields: Any) -> Domain:
        """Return the domain with other fields; it is not the one of its text any more."""
        return replace(self, text="", **fields)


TYPING: Final = frozenset({"typing", "adl", "ucpop"})
"""Requirements that allow for types."""


class Problem(PddlNode, frozen=True):
    """A planning problem.

    :param domain: the name of its domain.
    :param objects: the objects beyond the constants of the domain.
    :param init: the atoms that hold at the start; their arguments are constants.
    :param init_false: the atoms that are declared false at the start, as all missing ones are.
    :param numbers: the values of numeric functions at the start.
    :param goal: the condition that a plan must reach.
    :param metric: ``minimize`` or ``maximize`` and the term; None when any plan is as good.
    :param file: the file it was read from; empty when none.
    :param text: as of :class:`Domain`.
    """

    name: str
    domain: str
    objects: TypedList = ()
    init: tuple[Atom, ...] = ()
    init_false: tuple[Atom, ...] = ()
    numbers: tuple[tuple[FunctionTerm, float], ...] = ()
    goal: Formula = field(default_factory=lambda: And(()))
    metric: tuple[str, Term] | None = None
    file: str = ""
    text: str = ""

    def changed(self, **fields: Any) -> Problem:
        """Return the problem with other fields; it is not the one of its text any more."""
        return replace(self, text="", **fields)
