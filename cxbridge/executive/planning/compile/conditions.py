"""Ground conditions as alternatives of literals (disjunctive normal form).

Static parts are evaluated: equalities, quantifiers over the existing objects, and predicates that no action
changes. The remaining facts are required to be true or false.
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
from cxbridge.executive.pddl.types import ObjectTable, domains_of
from cxbridge.executive.planning.errors import PlanningError

MAX_ALTERNATIVES: Final = 4096
"""The maximum number of alternatives of a condition."""

Binding = Mapping[str, str]
"""Variables with their objects."""


class Fact(NamedTuple):
    """A predicate with its objects."""

    predicate: str
    arguments: tuple[str, ...]


class Conjunction(NamedTuple):
    """Facts required to be true, and facts required to be false."""

    positive: frozenset[Fact] = frozenset()
    negative: frozenset[Fact] = frozenset()

    def joined(self, other: Conjunction) -> Conjunction | None:
        """Return the union; None if it is contradictory."""
        positive, negative = self.positive | other.positive, self.negative | other.negative
        return None if positive & negative else Conjunction(positive, negative)


Alternatives = tuple[Conjunction, ...]
"""A disjunction: no alternative is false, an empty conjunction is true."""

FALSE: Final[Alternatives] = ()
TRUE: Final[Alternatives] = (Conjunction(),)


class Evaluator:
    """Converts formulas to alternatives.

    :param objects: the values of quantified variables.
    :param known: returns the truth of a static fact; None for other facts.
    """

    def __init__(self, objects: ObjectTable, known: Callable[[Fact], bool | None]) -> None:
        self._objects = objects
        self._known = known

    def alternatives(  # noqa: PLR0911  a case for each kind of formula
        self, formula: Formula | None, binding: Binding, *, negated: bool = False
    ) -> Alternatives:
        """Return the alternatives of a condition, or of its negation.

        :raises PlanningError: if there are too many alternatives.
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
        """Yield the binding extended by each choice of objects for the variables."""
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
    """Return the object of a term."""
    if isinstance(term, FunctionTerm):
        raise PlanningError(f"({term.function} ...) is a number, not an object")
    return binding[term.name] if isinstance(term, Variable) else term.name


def fact_of(atom: Atom, binding: Binding) -> Fact:
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
