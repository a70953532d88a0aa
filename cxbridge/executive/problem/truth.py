"""Truth of conditions in a known state, and the parts that make a condition false."""

from __future__ import annotations

import operator
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from itertools import product
from typing import Final, NamedTuple

from cxbridge.errors import PddlError
from cxbridge.executive.pddl.ast import (
    And,
    Bound,
    Constant,
    Formula,
    FunctionTerm,
    Ground,
    Imply,
    Not,
    Or,
    Quantified,
    State,
    Term,
    TypedList,
    Variable,
    number_of,
)

MOST_STEPS: Final = 200_000
"""The maximum number of evaluated parts of a formula, about a second of work."""

InstancesOf = Callable[[tuple[str, ...]], Collection[str]]
"""Returns the instances of some types; without types all instances."""

_COMPARE: Final[Mapping[str, Callable[[float, float], bool]]] = {
    "=": operator.eq,
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
_COMPUTE: Final[Mapping[str, Callable[[float, float], float]]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}
_SAME: Final = 1e-9  # sums of decimal fractions differ from their literals by rounding

DURATION: Final = "duration"
"""The variable of the time that a durative action takes."""


class KnownState:
    """A completely known state of facts, function values and objects.

    :param predicates: the facts.
    :param functions: the function values.
    :param duration: the value of ``?duration``, within a durative action.
    """

    def __init__(
        self,
        predicates: Collection[Ground],
        functions: Mapping[Ground, float],
        instances_of: InstancesOf,
        duration: float | None = None,
    ) -> None:
        self._predicates = predicates
        self._functions = functions
        self._instances_of = instances_of
        self._duration = duration
        self._steps = 0

    def look(self) -> None:
        """Count an evaluated formula.

        :raises PddlError: if quantified variables cause too many cases.
        """
        self._steps += 1
        if self._steps > MOST_STEPS:
            raise PddlError(
                f"the formula has more than {MOST_STEPS} cases to look at",
                hint="use fewer variables in 'exists' and 'forall', or types with fewer objects",
            )

    def has(self, predicate: str, terms: tuple[Term, ...], bound: Bound) -> bool:
        """Return whether a fact is true."""
        return self._ground(predicate, terms, bound) in self._predicates

    def compares(self, operator: str, left: Term, right: Term, bound: Bound) -> bool:
        """Return the result of a comparison, false if a function has no value."""
        if operator == "=" and not (self._is_number(left) or self._is_number(right)):
            name = _object(left, bound)
            return name is not None and name == _object(right, bound)
        return _compare(operator, self.number(left, bound), self.number(right, bound))

    def _is_number(self, term: Term) -> bool:
        return isinstance(term, FunctionTerm) or (
            self._duration is not None and isinstance(term, Variable) and term.name == DURATION
        )

    def _ground(self, name: str, terms: Iterable[Term], bound: Bound) -> Ground:
        return name, tuple(str(_object(term, bound)) for term in terms)

    def bindings(self, variables: TypedList, bound: Bound) -> Iterator[Bound]:
        """Yield ``bound`` extended by each choice of objects for the variables."""
        names = [name for group in variables for name in group.names]
        each = [self._instances_of(group.types) for group in variables for _ in group.names]
        for values in product(*each):
            yield {**bound, **dict(zip(names, values, strict=True))}

    def number(self, term: Term, bound: Bound) -> float | None:
        """Return the number of a term; None for an object or a function without value."""
        match term:
            case Variable(name=name):
                return self._duration if name == DURATION else None
            case Constant(name=name):
                return number_of(name)
            case FunctionTerm(function=name, arguments=terms):
                if name not in _COMPUTE:
                    return self._functions.get(self._ground(name, terms, bound))
                numbers = [self.number(each, bound) for each in terms]
                return _compute(name, [each for each in numbers if each is not None], len(terms))


def _object(term: Term, bound: Bound) -> str | None:
    """Return the object of a term; None for a number or an unbound variable."""
    match term:
        case Variable(name=name):
            return bound.get(name)
        case Constant(name=name):
            return name
        case FunctionTerm():
            return None


def _compute(sign: str, numbers: list[float], wanted: int) -> float | None:
    if len(numbers) != wanted or not numbers:
        return None
    if len(numbers) == 1:
        return -numbers[0] if sign == "-" else None
    found = numbers[0]
    for number in numbers[1:]:
        if sign == "/" and not number:
            return None
        found = _COMPUTE[sign](found, number)
    return found


def _compare(sign: str, first: float | None, second: float | None) -> bool:
    if first is None or second is None:
        return False
    if sign in ("=", "<=", ">=") and abs(first - second) <= _SAME:
        return True
    return _COMPARE[sign](first, second)


class Blamed(NamedTuple):
    """A part of a condition with the wrong truth value.

    :param wanted: the required truth value.
    """

    formula: Formula
    bound: Bound
    wanted: bool


def to_blame(
    formula: Formula, state: State, bound: Bound, *, wanted: bool = True, whole: bool = False
) -> Iterator[Blamed]:
    """Yield the smallest parts that keep a condition from the required truth value.

    A false conjunction is blamed on its false parts, a false disjunction on all its parts.

    :param whole: do not descend into disjunctions and negations.
    """
    if formula.holds(state, bound) == wanted:
        return
    parts: Iterable[tuple[Formula, Bound, bool]]
    match formula:
        case And() | Quantified(quantifier="forall"):
            divided = True
        case Or() | Quantified() | Not():
            divided = not whole
        case Imply():
            divided = wanted or not whole
        case _:
            divided = False
    if not divided:
        yield Blamed(formula, bound, wanted)
        return
    match formula:
        case Quantified(variables=variables, part=part):
            parts = ((part, inner, wanted) for inner in state.bindings(variables, bound))
        case Not(part=part):
            parts = ((part, bound, not wanted),)
        case Imply(condition=first, consequence=second):
            parts = ((second, bound, wanted), *(((first, bound, True),) if not wanted else ()))
        case _:
            parts = ((part, bound, wanted) for part in formula.children)
    for part, inner, value in parts:
        yield from to_blame(part, state, inner, wanted=value, whole=whole)
