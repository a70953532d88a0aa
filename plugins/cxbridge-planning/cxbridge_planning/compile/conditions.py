"""Ground conditions in disjunctive normal form: alternatives, each a conjunction of facts.

The static parts of a condition are evaluated here: equalities, quantifiers over the existing objects, and
predicates that no action changes. An alternative requires the remaining facts to be true or false.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Binding,
    Formula,
    FunctionTerm,
    Not,
    Or,
    Quantified,
    Term,
    TermComparison,
    TypedList,
    Variable,
)
from cxbridge.executive.pddl.types import extended_bindings
from cxbridge_planning.errors import PlanningError
from cxbridge_planning.objects import ObjectTable

# chosen freely
MAX_ALTERNATIVES: Final = 4096
"""The maximum number of alternatives of a condition."""


class Fact(NamedTuple):
    """A predicate with its objects."""

    predicate: str
    arguments: tuple[str, ...]


class Conjunction(NamedTuple):
    """Facts required to be true, and facts required to be false."""

    positive: frozenset[Fact] = frozenset()
    negative: frozenset[Fact] = frozenset()

    def join(self, other: Conjunction) -> Conjunction | None:
        """Return the conjunction of this and another; None if a fact would have to be true and false."""
        positive, negative = self.positive | other.positive, self.negative | other.negative
        return None if positive & negative else Conjunction(positive, negative)


Alternatives = tuple[Conjunction, ...]
"""A disjunction. It is false without alternatives, and true with an empty conjunction."""

FALSE: Final[Alternatives] = ()
TRUE: Final[Alternatives] = (Conjunction(),)


class DnfConverter:
    """Converts formulas to alternatives, their disjunctive normal form (DNF).

    :param objects: the values of quantified variables.
    :param static_truth: returns the truth of a fact that no action changes; None for other facts.
    """

    def __init__(self, objects: ObjectTable, static_truth: Callable[[Fact], bool | None]) -> None:
        self._objects = objects
        self._static_truth = static_truth

    def find_alternatives(
        self, formula: Formula | None, binding: Binding, *, is_negated: bool = False
    ) -> Alternatives:
        """Return the alternatives of a condition, or of its negation.

        :param formula: a condition without numbers; None: always true.
        :raises PlanningError: if there are too many alternatives, or if the condition has times.
        """
        if formula is None:
            return FALSE if is_negated else TRUE
        match formula.reduced:
            case Atom() as atom:
                return self._make_literal(atom, binding, is_negated=is_negated)
            case TermComparison(left=left, right=right):
                is_equal = object_of(left, binding) == object_of(right, binding)
                return TRUE if is_equal != is_negated else FALSE
            case Not(part=part):
                return self.find_alternatives(part, binding, is_negated=not is_negated)
            case And(parts=parts) | Or(parts=parts) as connective:
                operands = (self.find_alternatives(part, binding, is_negated=is_negated) for part in parts)
                # de Morgan: the negation of a conjunction is a disjunction of negations
                return _conjoin(operands) if isinstance(connective, And) != is_negated else _unite(operands)
            case Quantified(quantifier=quantifier, variables=variables, part=part):
                operands = (
                    self.find_alternatives(part, inner_binding, is_negated=is_negated)
                    for inner_binding in self.extend_binding(variables, binding)
                )
                return _conjoin(operands) if (quantifier == "forall") != is_negated else _unite(operands)
        raise PlanningError(f"a condition cannot contain {formula.KIND.feature or formula.head}")

    def extend_binding(self, variables: TypedList, binding: Binding) -> Iterator[Binding]:
        """Yield the binding extended by each choice of objects for the variables."""
        return extended_bindings(variables, binding, self._objects.of_types)

    def _make_literal(self, atom: Atom, binding: Binding, *, is_negated: bool) -> Alternatives:
        fact = fact_of(atom, binding)
        truth = self._static_truth(fact)
        if truth is not None:
            return TRUE if truth != is_negated else FALSE
        facts = frozenset((fact,))
        return (Conjunction(negative=facts) if is_negated else Conjunction(positive=facts),)


def object_of(term: Term, binding: Binding) -> str:
    """Return the name of a term's object."""
    assert not isinstance(term, FunctionTerm)  # planners that need this module refuse numbers
    return binding[term.name] if isinstance(term, Variable) else term.name


def fact_of(atom: Atom, binding: Binding) -> Fact:
    """Return the fact of an atom, with the objects of its terms."""
    return Fact(atom.predicate, tuple(object_of(argument, binding) for argument in atom.arguments))


def _conjoin(operands: Iterable[Alternatives]) -> Alternatives:
    """Return the alternatives of a conjunction: all combinations without contradictions."""
    combinations = TRUE
    for alternatives in operands:
        conjunctions = (first.join(second) for first in combinations for second in alternatives)
        combinations = _remove_duplicates(
            conjunction for conjunction in conjunctions if conjunction is not None
        )
        if not combinations:
            return FALSE
    return combinations


def _unite(operands: Iterable[Alternatives]) -> Alternatives:
    """Return the alternatives of a disjunction."""
    union: list[Conjunction] = []
    for alternatives in operands:
        if alternatives == TRUE:
            return TRUE
        union += alternatives
    return _remove_duplicates(union)


def _remove_duplicates(conjunctions: Iterable[Conjunction]) -> Alternatives:
    """Return distinct alternatives.

    :raises PlanningError: if there are too many alternatives.
    """
    alternatives = tuple(dict.fromkeys(conjunctions))
    # the number of combinations is exponential in the size of the condition
    if len(alternatives) > MAX_ALTERNATIVES:
        raise PlanningError(
            f"a condition has more than {MAX_ALTERNATIVES} alternatives",
            hint="use fewer 'or' and 'exists', or another planner (fast-downward)",
        )
    return alternatives
