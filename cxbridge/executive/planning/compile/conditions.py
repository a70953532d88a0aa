"""Conditions with their variables bound, as alternatives of literals (disjunctive normal form).

Unchangeable parts are decided here: equalities, quantifiers (over the existing objects), predicates that no
action changes. The remaining facts must be true or must be false.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import product
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Formula,
    FunctionTerm,
    Imply,
    Not,
    Or,
    Quantified,
    Term,
    TermComparison,
    TypedList,
    Variable,
)
from cxbridge.executive.planning.compile.objects import ObjectTable, domains_of
from cxbridge.executive.planning.errors import PlanningError

MAX_ALTERNATIVES: Final = 4096
"""Alternatives that one condition may become."""

Binding = Mapping[str, str]
"""The objects that variables stand for."""


class Fact(NamedTuple):
    """A predicate with its objects."""

    predicate: str
    arguments: tuple[str, ...]


class Conjunction(NamedTuple):
    """Facts that must be true, and facts that must be false."""

    positive: frozenset[Fact] = frozenset()
    negative: frozenset[Fact] = frozenset()

    def joined(self, other: Conjunction) -> Conjunction | None:
        """Return both at once; None when they contradict each other."""
        positive, negative = self.positive | other.positive, self.negative | other.negative
        return None if positive & negative else Conjunction(positive, negative)


Alternatives = tuple[Conjunction, ...]
"""One of them must hold: none is false, an empty conjunction is true."""

FALSE: Final[Alternatives] = ()
TRUE: Final[Alternatives] = (Conjunction(),)


class Evaluator:
    """Turns formulas into alternatives.

    :param objects: the values of quantified variables.
    :param known: the truth of a fact that can never change; None for the rest.
    """

    def __init__(self, objects: ObjectTable, known: Callable[[Fact], bool | None]) -> None:
        self._objects = objects
        self._known = known

    def alternatives(  # noqa: PLR0911  a case for each kind of formula
        self, formula: Formula | None, binding: Binding, *, negated: bool = False
    ) -> Alternatives:
        """Return a condition's alternatives; those of its negation if ``negated``.

        :raises PlanningError: for too many alternatives.
        """
        match formula:
            case None:
                return FALSE if negated else TRUE
            case Atom():
                return self._atom(formula, binding, negated=negated)
            case TermComparison(left=left, right=right):
                return TRUE if (bound(left, binding) == bound(right, binding)) != negated else FALSE
            case Not(part=part):
                return self.alternatives(part, binding, negated=not negated)
            case Imply(condition=condition, consequence=consequence):
                either = Or((Not(condition), consequence))
                return self.alternatives(either, binding, negated=negated)
            case And(parts=parts) | Or(parts=parts):
                each = (self.alternatives(part, binding, negated=negated) for part in parts)
                return _all(each) if isinstance(formula, And) != negated else _any(each)
            case Quantified(quantifier=quantifier, variables=variables, part=part):
                each = (
                    self.alternatives(part, inner, negated=negated)
                    for inner in self.bindings(variables, binding)
                )
                return _all(each) if (quantifier == "forall") != negated else _any(each)
        raise PlanningError(f"a condition cannot hold {type(formula).__name__}")

    def bindings(self, variables: TypedList, binding: Binding) -> Iterator[Binding]:
        """Yield a binding with these variables for each choice of objects."""
        names, objects = zip(*domains_of(variables, self._objects), strict=True) if variables else ((), ())
        for choice in product(*objects):
            yield {**binding, **dict(zip(names, choice, strict=True))}

    def _atom(self, atom: Atom, binding: Binding, *, negated: bool) -> Alternatives:
        fact = fact_of(atom, binding)
        known = self._known(fact)
        if known is not None:
            return TRUE if known != negated else FALSE
        alone = frozenset((fact,))
        return (Conjunction(negative=alone) if negated else Conjunction(positive=alone),)


def bound(term: Term, binding: Binding) -> str:
    """Return the object that a term stands for."""
    if isinstance(term, FunctionTerm):
        raise PlanningError(f"({term.function} ...) is a number, not an object")
    return binding[term.name] if isinstance(term, Variable) else term.name


def fact_of(atom: Atom, binding: Binding) -> Fact:
    """Return the fact that an atom stands for."""
    return Fact(atom.predicate, tuple(bound(argument, binding) for argument in atom.arguments))


def _all(parts: Iterable[Alternatives]) -> Alternatives:
    whole = TRUE
    for part in parts:
        pairs = (one.joined(other) for one in whole for other in part)
        whole = _unique(pair for pair in pairs if pair is not None)
        if not whole:
            return FALSE
    return whole


def _any(parts: Iterable[Alternatives]) -> Alternatives:
    found: list[Conjunction] = []
    for part in parts:
        if part == TRUE:
            return TRUE
        found += part
    return _unique(found)


def _unique(conjunctions: Iterable[Conjunction]) -> Alternatives:
    unique = tuple(dict.fromkeys(conjunctions))
    if len(unique) > MAX_ALTERNATIVES:
        raise PlanningError(
            f"a condition has more than {MAX_ALTERNATIVES} alternatives",
            hint="use fewer 'or' and 'exists', or another planner (fast-downward)",
        )
    return unique
