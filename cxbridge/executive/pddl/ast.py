"""The syntax tree of PDDL domains, problems and formulas, and the evaluation of conditions.

Nodes are immutable, and are equal if their content is equal, wherever they are in the text. The tree may
contain constructs that planners support, but facts of the CLIPS Executive cannot express (quantifiers,
conditional effects, numbers).

Each class of formulas describes itself by its ``KIND``: the first words of its text, the fields with formulas
and terms, the feature that planners need. The functions that walk, change, check and print formulas, and the
tables of words in other modules, need only this description.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from operator import attrgetter, is_
from types import MappingProxyType
from typing import Any, ClassVar, Final, NamedTuple, Protocol, get_args

from msgspec import Struct, field
from msgspec.structs import replace


class Position(NamedTuple):
    """Line and column, counted from 1."""

    line: int = 1
    column: int = 1


# a formula that is made from facts has no place in a text, but must equal the parsed formula
_UNCOMPARED_FIELDS: Final = ("position", "file", "text")


@cache
def _content_getter(node_class: type[PddlNode]) -> attrgetter[Any]:
    return attrgetter(*(name for name in node_class.__struct_fields__ if name not in _UNCOMPARED_FIELDS))


class PddlNode(Struct, frozen=True):
    """A node of the syntax tree, which equals another node with the same content at any position."""

    def __eq__(self, other: object) -> bool:
        content = _content_getter(type(self))
        return type(self) is type(other) and bool(content(self) == content(other))

    def __hash__(self) -> int:
        return hash(_content_getter(type(self))(self))


class PlacedNode(PddlNode, frozen=True, kw_only=True):
    """A node with its position in the text."""

    position: Position = Position()


class TypedNames(PlacedNode, frozen=True):
    """Names with a common type: ``a b - c``, or ``a b - (either c d)``.

    :param names: the names; variables are written without the question mark.
    :param types: the types of each name: empty without a type, several for ``either``.
    """

    names: tuple[str, ...]
    types: tuple[str, ...] = ()


TypedList = tuple[TypedNames, ...]

ROOT_TYPE: Final = "object"
"""The root of all types."""


def names_of(typed_list: TypedList) -> tuple[str, ...]:
    """Return the names of a typed list in order, with repetitions."""
    return tuple(name for group in typed_list for name in group.names)


def pairs_of(typed_list: TypedList) -> Iterator[tuple[str, str]]:
    """Yield each name with its type. ``either`` yields all names once per type; a missing type is empty."""
    for group in typed_list:
        for type_ in group.types or ("",):
            for name in group.names:
                yield name, type_


class Variable(PlacedNode, frozen=True):
    """A variable, written without the question mark."""

    name: str


class Constant(PlacedNode, frozen=True):
    """An object or a number, as written. The grammar cannot tell the object ``12`` from the number."""

    name: str


_NUMBER: Final = re.compile(r"[+-]?(\d+(?:\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def number_of(text: str) -> float | None:
    """Return the value of a PDDL number; None for a name, including ``inf`` and ``nan``."""
    # float() alone would accept names and underscores
    return float(text) if _NUMBER.fullmatch(text) else None


ARITHMETIC: Final = frozenset({"+", "-", "*", "/"})
TOTAL_COST: Final = "total-cost"
"""The function that PDDL reserves for the cost of a plan."""

TOTAL_TIME: Final = "total-time"
"""The function that PDDL predefines for metrics: the duration of a plan."""


class FunctionTerm(PlacedNode, frozen=True):
    """The value of a function or arithmetic operator: ``(distance ?a ?b)``, ``(+ (f) 3)``."""

    function: str
    arguments: tuple[Term, ...]


Term = Variable | Constant | FunctionTerm


Ground = tuple[str, tuple[str, ...]]
"""The name of a predicate or function, and its objects."""

Binding = Mapping[str, str]
"""The objects of variables, by the names of the variables."""

EMPTY_BINDING: Final[Binding] = MappingProxyType({})
"""The binding of a formula without free variables."""


# a protocol, because the states are in packages that import this package
class State(Protocol):
    """The facts at one moment, for the evaluation of conditions."""

    def has(self, predicate: str, terms: tuple[Term, ...], binding: Binding) -> bool:
        """Return whether the fact is true."""

    def compare(self, operator: str, left: Term, right: Term, binding: Binding) -> bool:
        """Return whether a comparison is true."""

    def bindings(self, variables: TypedList, binding: Binding) -> Iterator[Binding]:
        """Yield ``binding`` extended by each choice of objects for the variables."""

    def count_evaluation(self) -> None:
        """Count an evaluated formula.

        :raises PddlError: if too many formulas have been evaluated.
        """


class BlamedPart(NamedTuple):
    """A part of a condition, which is blamed if it does not have the required truth value."""

    formula: Formula
    binding: Binding
    required: bool


class FormulaKind(Struct, frozen=True):
    """The description of a class of formulas.

    :param words: the first words of the text; if there are several, the first field has the formula's word.
        Empty for atoms, which begin with a predicate.
    :param feature: the feature of PDDL beyond typed STRIPS, with its name in
        ``cxbridge_planning.needs.Need``; empty for a formula of STRIPS.
    :param parts: the names of the fields that hold a formula or a tuple of formulas.
    :param terms: the names of the fields that hold a term or a tuple of terms.
    :param is_condition: whether a state can make the formula true. Effects and formulas with a time are false
        in every state.
    """

    words: tuple[str, ...]
    feature: str
    parts: tuple[str, ...] = ()
    terms: tuple[str, ...] = ()
    is_condition: bool = True


class FormulaNode(PlacedNode, frozen=True):
    """A formula: a condition or an effect."""

    KIND: ClassVar[FormulaKind]

    @property
    def head(self) -> str:
        """The first word of the formula's text; the first two words of a formula with a time."""
        words = self.KIND.words
        # without a single word of its class, a formula has its word in the first field
        return words[0] if len(words) == 1 else str(getattr(self, self.__struct_fields__[0]))

    @property
    def variables(self) -> TypedList:
        """The variables that the formula declares for its parts; a field of quantified formulas."""
        return ()

    @property
    def reduced(self) -> Formula:
        """An equivalent condition of conjunctions, disjunctions and negations; by default this formula."""
        return self  # type: ignore[return-value]  # Formula is the union of all subclasses

    @property
    def children(self) -> tuple[Formula, ...]:
        """The direct sub-formulas in textual order."""
        return tuple(_list_values(self, self.KIND.parts))

    @property
    def terms(self) -> tuple[Term, ...]:
        """The terms of this formula, without those of its children."""
        return tuple(_list_values(self, self.KIND.terms))

    def walk(self) -> Iterator[Formula]:
        """Yield this formula and all its descendants, parents first."""
        # recursion is safe, because the tokeniser limits the nesting of brackets
        yield self  # type: ignore[misc]  # Formula is the union of all subclasses
        for child in self.children:
            yield from child.walk()

    def holds(self, state: State, binding: Binding = EMPTY_BINDING) -> bool:
        """Return whether the condition is true in a state.

        :param binding: the objects of its free variables.
        :raises PddlError: if the evaluation needs too many cases, because of quantified variables.
        """
        state.count_evaluation()
        return self._holds(state, binding)

    def _holds(self, state: State, binding: Binding) -> bool:
        if not self.KIND.is_condition:
            return False
        if self.reduced is self:  # without either method, the call would never end
            raise NotImplementedError(f"{type(self).__name__} has neither _holds nor reduced")
        return self.reduced.holds(state, binding)

    def deciding_parts(
        self,
        state: State,  # noqa: ARG002 - for quantifiers
        binding: Binding,
        *,
        required: bool,
    ) -> Iterable[BlamedPart]:
        """Return the parts that decide the truth value, each with its required truth value.

        :param required: the required truth value of this formula.
        """
        return (BlamedPart(part, binding, required) for part in self.reduced.children)

    def map(self, change: Callable[[Formula], Formula]) -> Formula:
        """Return the formula with ``change`` applied to the formula and its descendants, children first."""
        return change(_with_values(self, self.KIND.parts, lambda part: part.map(change)))

    def map_terms(self, change: Callable[[Term], Term]) -> Formula:
        """Return the formula with ``change`` applied to each term, inner terms first."""
        return self.map(
            lambda formula: _with_values(formula, formula.KIND.terms, lambda term: map_term(term, change))
        )


def map_term(term: Any, change: Callable[[Term], Term]) -> Any:
    """Return a term with ``change`` applied to the term and to its arguments, inner terms first."""
    if isinstance(term, FunctionTerm):
        term = _with_values(term, ("arguments",), lambda argument: map_term(argument, change))
    return change(term)


def _with_values(node: Any, fields: tuple[str, ...], change: Callable[[Any], Any]) -> Any:
    """Return a node with ``change`` applied to some fields; the same node if nothing changes."""
    # most changes concern few nodes of a large tree: copies share the unchanged nodes
    new_values = {}
    for name in fields:
        value = getattr(node, name)
        new_value = tuple(map(change, value)) if isinstance(value, tuple) else change(value)
        is_same = all(map(is_, new_value, value)) if isinstance(value, tuple) else new_value is value
        if not is_same:
            new_values[name] = new_value
    return replace(node, **new_values) if new_values else node


def _list_values(node: FormulaNode, fields: tuple[str, ...]) -> Iterator[Any]:
    """Yield the values of fields, and the elements of values that are tuples."""
    for name in fields:
        value = getattr(node, name)
        if isinstance(value, tuple):
            yield from value
        else:
            yield value


class Atom(FormulaNode, frozen=True):
    """A predicate with its arguments, e.g. ``(at ?r home)``."""

    KIND: ClassVar = FormulaKind((), "", terms=("arguments",))

    predicate: str
    arguments: tuple[Term, ...]

    def _holds(self, state: State, binding: Binding) -> bool:
        return state.has(self.predicate, self.arguments, binding)


def make_ground(name: str, term: Atom | FunctionTerm) -> Ground:
    """Return the ground form of an atom or function term, whose arguments must be constants.

    :param name: the predicate or function of the term.
    """
    return name, tuple(argument.name for argument in term.arguments if isinstance(argument, Constant))


class And(FormulaNode, frozen=True):
    """A conjunction. An empty conjunction is true."""

    KIND: ClassVar = FormulaKind(("and",), "", parts=("parts",))

    parts: tuple[Formula, ...]

    def _holds(self, state: State, binding: Binding) -> bool:
        return all(part.holds(state, binding) for part in self.parts)


class Or(FormulaNode, frozen=True):
    KIND: ClassVar = FormulaKind(("or",), "disjunctions", parts=("parts",))

    parts: tuple[Formula, ...]

    def _holds(self, state: State, binding: Binding) -> bool:
        return any(part.holds(state, binding) for part in self.parts)


class Not(FormulaNode, frozen=True):
    KIND: ClassVar = FormulaKind(("not",), "negative conditions", parts=("part",))

    part: Formula

    def _holds(self, state: State, binding: Binding) -> bool:
        return not self.part.holds(state, binding)

    def deciding_parts(self, _state: State, binding: Binding, *, required: bool) -> Iterable[BlamedPart]:
        return (BlamedPart(self.part, binding, not required),)


class Imply(FormulaNode, frozen=True):
    KIND: ClassVar = FormulaKind(("imply",), "disjunctions", parts=("condition", "consequence"))

    condition: Formula
    consequence: Formula

    @property
    def reduced(self) -> Formula:
        return Or((Not(self.condition), self.consequence), position=self.position)

    def deciding_parts(self, _state: State, binding: Binding, *, required: bool) -> Iterable[BlamedPart]:
        # a false implication is blamed on its consequence alone
        yield BlamedPart(self.consequence, binding, required)
        if not required:
            yield BlamedPart(self.condition, binding, required=True)


class TermComparison(FormulaNode, frozen=True):
    """``=`` of two terms, or ``<``, ``>``, ``<=``, ``>=`` of two numbers."""

    KIND: ClassVar = FormulaKind(("=", "<", ">", "<=", ">="), "equality", terms=("left", "right"))

    operator: str
    left: Term
    right: Term

    def _holds(self, state: State, binding: Binding) -> bool:
        return state.compare(self.operator, self.left, self.right, binding)


class Timed(FormulaNode, frozen=True):
    """A formula with a time of a durative action: ``at start``, ``at end`` or ``over all``."""

    KIND: ClassVar = FormulaKind(
        ("at start", "at end", "over all"), "durative actions", parts=("part",), is_condition=False
    )

    when: str
    part: Formula


class Quantified(FormulaNode, frozen=True):
    """A formula with ``exists`` or ``forall``."""

    KIND: ClassVar = FormulaKind(("exists", "forall"), "quantifiers", parts=("part",))

    quantifier: str
    variables: TypedList
    part: Formula

    def _holds(self, state: State, binding: Binding) -> bool:
        combine = any if self.quantifier == "exists" else all
        return combine(self.part.holds(state, inner) for inner in state.bindings(self.variables, binding))

    def deciding_parts(self, state: State, binding: Binding, *, required: bool) -> Iterable[BlamedPart]:
        return (BlamedPart(self.part, inner, required) for inner in state.bindings(self.variables, binding))


class When(FormulaNode, frozen=True):
    KIND: ClassVar = FormulaKind(
        ("when",), "conditional effects", parts=("condition", "effect"), is_condition=False
    )

    condition: Formula
    effect: Formula


class NumericChange(FormulaNode, frozen=True):
    """A numeric effect: increase, decrease, assign, scale-up or scale-down."""

    KIND: ClassVar = FormulaKind(
        ("increase", "decrease", "assign", "scale-up", "scale-down"),
        "effects on numbers",
        terms=("target", "amount"),
        is_condition=False,
    )

    operator: str
    target: Term
    amount: Term


Formula = Atom | And | Or | Not | Imply | TermComparison | Timed | Quantified | When | NumericChange
FORMULA_CLASSES: Final[tuple[type[FormulaNode], ...]] = get_args(Formula)

TIME_WORDS: Final = frozenset(tuple(time.split()) for time in Timed.KIND.words)
"""The first two words of formulas with a time."""

FORMULA_WORDS: Final = tuple(
    word
    for formula_class in FORMULA_CLASSES
    if formula_class is not Timed
    for word in formula_class.KIND.words
)
"""The first words of formulas without a time, except atoms."""

QUANTIFIER_WORDS: Final = tuple(
    word
    for formula_class in FORMULA_CLASSES
    if "variables" in formula_class.__struct_fields__
    for word in formula_class.KIND.words
)
"""The first words of formulas whose second item declares variables."""


class Declaration(PlacedNode, frozen=True):
    """The declaration of a predicate or of a numeric function."""

    name: str
    parameters: TypedList


class ActionSchema(PlacedNode, frozen=True):
    """An action with parameters.

    :param is_durative: whether the action is a ``:durative-action``.
    :param duration: the constraint on ``?duration``, e.g. ``(= ?duration 5)``; None if the action has none.
    :param condition: the precondition; None if the action has none.
    :param effect: the effect; None if the action has none.
    """

    name: str
    parameters: TypedList = ()
    condition: Formula | None = None
    effect: Formula | None = None
    is_durative: bool = False
    duration: Formula | None = None


class Domain(PddlNode, frozen=True):
    """A planning domain.

    :param requirements: the requirements in lower case, without their colons.
    :param file: the source file; empty if there is none.
    :param text: the source text, for planners with a PDDL parser; empty after changes or without a source.
    """

    name: str
    requirements: tuple[str, ...] = ()
    types: TypedList = ()
    constants: TypedList = ()
    predicates: tuple[Declaration, ...] = ()
    functions: tuple[Declaration, ...] = ()
    actions: tuple[ActionSchema, ...] = ()
    file: str = ""
    text: str = ""

    @property
    def requires_typing(self) -> bool:
        """Whether the requirements permit types. cxbridge ignores all other requirements."""
        return not {"typing", "adl", "ucpop"}.isdisjoint(self.requirements)

    @property
    def typed_lists(self) -> list[TypedList]:
        """First the types, then the constants and the parameters of predicates, functions and actions."""
        declarations: tuple[Declaration | ActionSchema, ...]
        declarations = (*self.predicates, *self.functions, *self.actions)
        return [self.types, self.constants, *(declaration.parameters for declaration in declarations)]

    @property
    def is_typed(self) -> bool:
        """Whether the domain uses types, or its requirements permit types."""
        return self.requires_typing or any(group.types for groups in self.typed_lists for group in groups)

    def changed(self, **fields: Any) -> Domain:
        """Return a changed copy, without the source text."""
        return replace(self, text="", **fields)


class Problem(PddlNode, frozen=True):
    """A planning problem.

    :param objects: the objects in addition to the domain's constants.
    :param init: the true atoms of the initial state, with constants as arguments.
    :param numbers: the initial values of numeric functions.
    :param goal: the condition that a plan must achieve.
    :param metric: ``minimize`` or ``maximize``, and the term; None without a metric.
    :param file: the source file; empty if there is none.
    :param text: the source text, as in :class:`Domain`.
    """

    name: str
    domain: str
    objects: TypedList = ()
    init: tuple[Atom, ...] = ()
    numbers: tuple[tuple[FunctionTerm, float], ...] = ()
    goal: Formula = field(default_factory=lambda: And(()))
    metric: tuple[str, Term] | None = None
    file: str = ""
    text: str = ""

    def changed(self, **fields: Any) -> Problem:
        """Return a changed copy, without the source text."""
        return replace(self, text="", **fields)
