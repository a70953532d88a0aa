"""The PDDL requirements of a domain and a problem beyond STRIPS with types."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum

from cxbridge.executive.pddl import Domain, Formula, Problem
from cxbridge.executive.pddl.ast import (
    And,
    FunctionTerm,
    Imply,
    Not,
    NumericChange,
    Or,
    Quantified,
    TermComparison,
    Timed,
    When,
)


class Need(Enum):
    """Something that not every planner understands; the value names it to people."""

    NEGATION = "negative conditions"
    DISJUNCTION = "disjunctions"
    QUANTIFIERS = "quantifiers"
    CONDITIONAL_EFFECTS = "conditional effects"
    EQUALITY = "equality"
    COSTS = "costs of actions"
    NUMBERS = "numbers"
    TIME = "durative actions"


CLASSICAL = frozenset(
    {Need.NEGATION, Need.DISJUNCTION, Need.QUANTIFIERS, Need.CONDITIONAL_EFFECTS, Need.EQUALITY, Need.COSTS}
)
"""All but numbers and time."""

TOTAL_COST = "total-cost"
"""The one number that says nothing but how much a plan costs."""


def needs_of(domain: Domain, problem: Problem) -> dict[Need, str]:
    """Return what the problem needs, each with where it was seen first, e.g. ``action pick``."""
    needs: dict[Need, str] = {}
    for action in domain.actions:
        where = f"action {action.name}"
        if action.durative:
            needs.setdefault(Need.TIME, where)
        for formula, effect in ((action.condition, False), (action.effect, True)):
            for need in _needs(formula, effect=effect):
                needs.setdefault(need, where)
    for need in _needs(problem.goal, effect=False):
        needs.setdefault(need, "the goal")
    return needs


def _needs(  # noqa: C901, PLR0912  a case for each kind of formula
    formula: Formula | None, *, effect: bool
) -> Iterator[Need]:
    match formula:
        case And(parts=parts):
            for part in parts:
                yield from _needs(part, effect=effect)
        case Or(parts=parts):
            yield Need.DISJUNCTION
            for part in parts:
                yield from _needs(part, effect=effect)
        case Imply(condition=condition, consequence=part):
            yield Need.DISJUNCTION
            yield from _needs(condition, effect=effect)
            yield from _needs(part, effect=effect)
        case Not(part=part):
            if not effect and not isinstance(part, TermComparison):
                yield Need.NEGATION
            yield from _needs(part, effect=effect)
        case Quantified(part=part):
            yield Need.QUANTIFIERS
            yield from _needs(part, effect=effect)
        case When(condition=condition, effect=part):
            yield Need.CONDITIONAL_EFFECTS
            yield from _needs(condition, effect=False)
            yield from _needs(part, effect=True)
        case Timed(part=part):
            yield Need.TIME
            yield from _needs(part, effect=effect)
        case TermComparison(operator=operator, left=left, right=right):
            numeric = operator != "=" or isinstance(left, FunctionTerm) or isinstance(right, FunctionTerm)
            yield Need.NUMBERS if numeric else Need.EQUALITY
        case NumericChange(operator=operator, target=target):
            cost = (
                operator == "increase" and isinstance(target, FunctionTerm) and target.function == TOTAL_COST
            )
            yield Need.COSTS if cost else Need.NUMBERS
        case _:
            return
