"""Whether a formula without parameters is true, given what is known."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from itertools import product
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Constant,
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
    number_of,
)

MOST_STEPS: Final = 200_000
"""Parts of a formula that are looked at, each for each choice of objects: a second of work at most."""

Ground = tuple[str, tuple[str, ...]]
"""A predicate or function with its objects."""

InstancesOf = Callable[[tuple[str, ...]], Collection[str]]
"""Returns the instances of some types; of no types: all."""

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
_WORDS: Final = re.compile(r"[^\s()]+")
_SAME: Final = 1e-9

DURATION: Final = "duration"
"""The variable that stands for how long a durative action takes."""


def words_of(text: str) -> list[str]:
    """Return the words of a text of PDDL."""
    return _WORDS.findall(text)


def holds(
    formula: Formula,
    predicates: Collection[Ground],
    functions: Mapping[Ground, float],
    instances_of: InstancesOf,
) -> bool:
    """Return whether a formula is true. A comparison with a function that has no value is not.

    :raises PddlError: when quantified variables make too many cases.
    """
    return Truth(predicates, functions, instances_of).of(formula, {})


class Truth:
    """The truth of formulas in one state.

    :param predicates: what is true.
    :param functions: the values of functions.
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

    def of(self, formula: Formula, bound: Mapping[str, str]) -> bool:
        """Return whether a formula is true.

        :param bound: the objects that its variables stand for.
        :raises PddlError: when quantified variables make too many cases.
        """
        self._steps += 1
        if self._steps > MOST_STEPS:
            raise PddlError(
                f"the formula has more than {MOST_STEPS} cases to look at",
                hint="use fewer variables in 'exists' and 'forall', or types with fewer objects",
            )
        match formula:
            case Atom(predicate=name, arguments=terms):
                found = self._ground(name, terms, bound) in self._predicates
            case And(parts=parts):
                found = all(self.of(part, bound) for part in parts)
            case Or(parts=parts):
                found = any(self.of(part, bound) for part in parts)
            case Not(part=part):
                found = not self.of(part, bound)
            case Imply(condition=first, consequence=second):
                found = not self.of(first, bound) or self.of(second, bound)
            case Quantified(quantifier=quantifier, part=part):
                some = any if quantifier == "exists" else all
                found = some(self.of(part, inner) for inner in self.bindings(formula.variables, bound))
            case TermComparison(operator=sign, left=left, right=right):
                found = self._compared(sign, left, right, bound)
            case _:
                found = False  # an effect, or a part of a durative action: no condition
        return found

    def _compared(self, sign: str, left: Term, right: Term, bound: Mapping[str, str]) -> bool:
        if sign == "=" and not (self._is_number(left) or self._is_number(right)):
            name = _object(left, bound)
            return name is not None and name == _object(right, bound)
        return _compare(sign, self.number(left, bound), self.number(right, bound))

    def _is_number(self, term: Term) -> bool:
        return isinstance(term, FunctionTerm) or (
            self._duration is not None and isinstance(term, Variable) and term.name == DURATION
        )

    def _ground(self, name: str, terms: Iterable[Term], bound: Mapping[str, str]) -> Ground:
        return name, tuple(str(_object(term, bound)) for term in terms)

    def bindings(self, variables: TypedList, bound: Mapping[str, str]) -> Iterator[dict[str, str]]:
        """Yield ``bound`` with a choice of objects for some variables more, for each choice."""
        names = [name for group in variables for name in group.names]
        each = [self._instances_of(group.types) for group in variables for _ in group.names]
        for values in product(*each):
            yield {**bound, **dict(zip(names, values, strict=True))}

    def number(self, term: Term, bound: Mapping[str, str]) -> float | None:
        """Return the number that a term stands for; None for an object, and a function without a value."""
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


def _object(term: Term, bound: Mapping[str, str]) -> str | None:
    """Return the object that a term stands for; None for a number, and a variable without a value."""
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
