"""The state of facts, numbers and objects in which conditions are evaluated.

:func:`blamed_parts` finds the parts of a condition that keep it from a required truth value.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from functools import reduce
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.pddl.ast import (
    TOTAL_COST,
    Binding,
    BlamedPart,
    Constant,
    Formula,
    FunctionTerm,
    Ground,
    Not,
    NumericChange,
    Or,
    Quantified,
    State,
    Term,
    TypedList,
    Variable,
    number_of,
)
from cxbridge.executive.pddl.printer import format_term
from cxbridge.executive.pddl.types import ObjectsOf, extended_bindings

MAX_EVALUATIONS: Final = 200_000
"""The maximum number of evaluated formulas per state, with their parts: about a second of work."""

_COMPARATORS: Final[Mapping[str, Callable[[float, float], bool]]] = {
    "=": operator.eq,
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
_ARITHMETIC: Final[Mapping[str, Callable[[float, float], float]]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}
_NUMBER_CHANGES: Final[Mapping[str, Callable[[float, float], float]]] = {
    "assign": lambda _value, amount: amount,
    "increase": operator.add,
    "decrease": operator.sub,
    "scale-up": operator.mul,
    "scale-down": operator.truediv,
}
_MAX_ROUNDING_ERROR: Final = 1e-9  # e.g. 0.1 + 0.2 differs from 0.3

DURATION: Final = "duration"
"""The variable of the time that a durative action takes."""


class KnownState:
    """A completely known state of facts, function values and objects: the ``State`` of :mod:`.pddl.ast`.

    :param facts: the true atoms of predicates.
    :param numbers: the values of functions.
    :param objects_of: the objects of quantified variables; by default there are none.
    :param duration: the value of ``?duration``, within a durative action.
    """

    def __init__(
        self,
        facts: Container[Ground],
        numbers: Mapping[Ground, float],
        objects_of: ObjectsOf = lambda _types: (),
        duration: float | None = None,
    ) -> None:
        self._facts, self._numbers = facts, numbers
        self._objects_of, self._duration = objects_of, duration
        self._evaluations = 0

    def count_evaluation(self) -> None:
        """Count an evaluated formula.

        :raises PddlError: if quantified variables cause too many cases.
        """
        # a limit of work rather than of time, so that a formula fails on every machine or on none
        self._evaluations += 1
        if self._evaluations > MAX_EVALUATIONS:
            raise PddlError(
                f"the formula has more than {MAX_EVALUATIONS} cases to evaluate",
                hint="use fewer variables in 'exists' and 'forall', or types with fewer objects",
            )

    def has(self, predicate: str, terms: tuple[Term, ...], binding: Binding) -> bool:
        """Return whether a fact is true."""
        return self._ground(predicate, terms, binding) in self._facts

    def compare(self, operator: str, left: Term, right: Term, binding: Binding) -> bool:
        """Return whether a comparison is true; it is false if a function has no value."""
        if operator == "=" and not (self._is_number(left) or self._is_number(right)):
            name = _object(left, binding)
            return name is not None and name == _object(right, binding)
        return _compare(operator, self.number(left, binding), self.number(right, binding))

    def _is_number(self, term: Term) -> bool:
        """Return whether a term is a number.

        Constants do not count, because the name of an object may look like a number.
        """
        return isinstance(term, FunctionTerm) or (
            self._duration is not None and isinstance(term, Variable) and term.name == DURATION
        )

    def _ground(self, name: str, terms: Iterable[Term], binding: Binding) -> Ground:
        # a number or an unbound variable becomes the name "None", which no object of a usual domain has
        return name, tuple(str(_object(term, binding)) for term in terms)

    def bindings(self, variables: TypedList, binding: Binding) -> Iterator[Binding]:
        """Yield ``binding`` extended by each choice of objects for the variables."""
        return extended_bindings(variables, binding, self._objects_of)

    def number(self, term: Term, binding: Binding) -> float | None:
        """Return the number of a term; None for an object or a function without value."""
        match term:
            case Variable(name=name):
                return self._duration if name == DURATION else None
            case Constant(name=name):
                return number_of(name)
            case FunctionTerm(function=name, arguments=terms):
                if name not in _ARITHMETIC:
                    return self._numbers.get(self._ground(name, terms, binding))
                return _compute(name, [self.number(operand, binding) for operand in terms])

    def change_number(self, change: NumericChange, binding: Binding, new_values: dict[Ground, float]) -> None:
        """Add the effect on a number to the new values.

        Several effects on a number add up: each one starts from the new value, if there is one.

        :raises PddlError: if a number has no value, or for a division by zero.
        """
        target = change.target
        assert isinstance(target, FunctionTerm)
        ground = self._ground(target.function, target.arguments, binding)
        amount = self.number(change.amount, binding)
        value = new_values.get(ground, self.number(target, binding))
        # problems with a metric often omit (= (total-cost) 0), which planners accept
        if value is None and (target.function == TOTAL_COST or change.operator == "assign"):
            value = 0.0
        if amount is None or value is None:
            term = bind_term(target if value is None else change.amount, binding)
            raise PddlError(f"{format_term(term)} has no value")
        if change.operator == "scale-down" and not amount:
            raise PddlError(f"{format_term(bind_term(target, binding))} cannot be divided by zero")
        new_values[ground] = _NUMBER_CHANGES[change.operator](value, amount)


def bind_term(term: Term, binding: Binding) -> Term:
    """Return a term with objects in place of variables."""
    match term:
        case Variable(name=name) if name in binding:
            return Constant(binding[name])
        case FunctionTerm(function=name, arguments=terms):
            return FunctionTerm(name, tuple(bind_term(argument, binding) for argument in terms))
        case _:
            return term


def _object(term: Term, binding: Binding) -> str | None:
    """Return the object of a term; None for a number or an unbound variable."""
    match term:
        case Variable(name=name):
            return binding.get(name)
        case Constant(name=name):
            return name
        case FunctionTerm():
            return None


def _compute(sign: str, operands: list[float | None]) -> float | None:
    """Return the result of an arithmetic operator.

    A single operand is permitted for the negation only. None if an operand has no value, for a division by
    zero, and for a wrong number of operands.
    """
    numbers = [operand for operand in operands if operand is not None]
    if len(numbers) != len(operands) or not numbers:
        return None
    if len(numbers) == 1:
        return -numbers[0] if sign == "-" else None
    try:
        return reduce(_ARITHMETIC[sign], numbers)
    except ZeroDivisionError:
        return None


def _compare(sign: str, first: float | None, second: float | None) -> bool:
    if first is None or second is None:
        return False
    if sign in ("=", "<=", ">=") and abs(first - second) <= _MAX_ROUNDING_ERROR:
        return True
    return _COMPARATORS[sign](first, second)


def blamed_parts(
    formula: Formula, state: State, binding: Binding, *, required: bool = True, keeps_choices: bool = False
) -> Iterator[BlamedPart]:
    """Yield the smallest parts that keep a condition from a required truth value.

    A false conjunction is blamed on its false parts, a false disjunction on all its parts, and a false
    implication on its consequence.

    :param required: the required truth value.
    :param keeps_choices: whether disjunctions, ``exists`` and negations are blamed as a whole.
    """
    if formula.holds(state, binding) == required:
        return
    is_choice = isinstance(formula, Or | Not) or (
        isinstance(formula, Quantified) and formula.quantifier == "exists"
    )
    parts = (
        ()
        if keeps_choices and is_choice
        else tuple(formula.deciding_parts(state, binding, required=required))
    )
    if not parts:
        yield BlamedPart(formula, binding, required)
    for part, inner_binding, inner_required in parts:
        yield from blamed_parts(
            part, state, inner_binding, required=inner_required, keeps_choices=keeps_choices
        )
