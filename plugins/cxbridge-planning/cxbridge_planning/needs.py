"""The features of PDDL beyond typed STRIPS that a domain and problem use.

The features come from the formulas rather than from ``:requirements``, which domains often omit. A planner
names the features that it supports.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum

from cxbridge.executive.pddl.ast import (
    ROOT_TYPE,
    TOTAL_COST,
    TOTAL_TIME,
    Constant,
    Domain,
    Formula,
    FunctionTerm,
    Not,
    NumericChange,
    Problem,
    Term,
    TermComparison,
    When,
    number_of,
    pairs_of,
)


class Need(Enum):
    """A feature that some planners lack.

    The value is its name in messages, and the ``feature`` of the kinds of formulas in
    :mod:`cxbridge.executive.pddl.ast`.
    """

    HIERARCHY = "subtypes"
    NEGATION = "negative conditions"
    DISJUNCTION = "disjunctions"
    QUANTIFIERS = "quantifiers"
    CONDITIONAL_EFFECTS = "conditional effects"
    EQUALITY = "equality"
    COSTS = "costs of actions"
    # effects on numbers, except an increase of the total cost; conditions on numbers need NUMBERS
    NUMERIC_CHANGES = "effects on numbers"
    NUMBERS = "numbers"
    FRACTIONS = "numbers with fractions"
    TIME = "durative actions"


CLASSICAL = frozenset(
    {
        Need.HIERARCHY,
        Need.NEGATION,
        Need.DISJUNCTION,
        Need.QUANTIFIERS,
        Need.CONDITIONAL_EFFECTS,
        Need.EQUALITY,
    }
)
"""All features except numbers, costs and time."""


def problem_needs(domain: Domain, problem: Problem) -> dict[Need, str]:
    """Return the required features, each with its first user, e.g. ``action pick``."""
    needs: dict[Need, str] = {}
    for user, formula, is_effect in _list_formulas(domain, problem):
        for need in _find_formula_needs(formula, is_effect=is_effect):
            needs.setdefault(need, user)
    for action in domain.actions:
        if action.is_durative:
            needs.setdefault(Need.TIME, f"action {action.name}")
    # a type without a declared supertype is a direct subtype of the root
    if any(supertype not in ("", ROOT_TYPE) for _, supertype in pairs_of(domain.types)):
        needs[Need.HIERARCHY] = "the types"
    if problem.metric is not None:
        _direction, term = problem.metric
        if term != FunctionTerm(TOTAL_TIME, ()):
            needs[Need.COSTS] = "the metric"
    if {Need.NUMBERS, Need.TIME} & needs.keys() and _has_fractions(domain, problem):
        needs[Need.FRACTIONS] = "the values of functions"
    return needs


def _list_formulas(domain: Domain, problem: Problem) -> Iterator[tuple[str, Formula, bool]]:
    """Yield each formula with its user, and whether it is an effect."""
    for action in domain.actions:
        for formula, is_effect in ((action.condition, False), (action.effect, True)):
            if formula is not None:
                yield f"action {action.name}", formula, is_effect
    yield "the goal", problem.goal, False


def _has_fractions(domain: Domain, problem: Problem) -> bool:
    """Return whether numbers may get fractions. Some planners know integers only."""
    formulas = [formula for _, formula, _ in _list_formulas(domain, problem)]
    formulas += [action.duration for action in domain.actions if action.duration is not None]
    parts = [part for formula in formulas for part in formula.walk()]
    return (
        any(value != int(value) for _, value in problem.numbers)
        or any(isinstance(part, NumericChange) and part.operator == "scale-down" for part in parts)
        or any(_is_fraction(term) for part in parts for term in part.terms)
    )


def _is_fraction(term: Term) -> bool:
    """Return whether a term is or contains a number with a fraction, or a division."""
    match term:
        case Constant(name=name):
            value = number_of(name)
            return value is not None and value != int(value)
        case FunctionTerm(function=name, arguments=terms):
            return name == "/" or any(map(_is_fraction, terms))
        case _:
            return False


def _find_formula_needs(formula: Formula, *, is_effect: bool) -> Iterator[Need]:
    """Yield the features of a formula.

    :param is_effect: whether a negation is a deletion rather than a feature.
    """
    match formula:
        case When(condition=condition, effect=part):
            yield Need.CONDITIONAL_EFFECTS
            yield from _find_formula_needs(condition, is_effect=False)
            yield from _find_formula_needs(part, is_effect=True)
            return
        case Not(part=part) if is_effect or isinstance(part, TermComparison):
            pass  # planners with equality support (not (= ?a ?b)), too
        case TermComparison(operator=operator) if operator != "=" or any(
            isinstance(term, FunctionTerm) for term in formula.terms
        ):
            yield Need.NUMBERS
        case NumericChange(operator="increase", target=target) if target == FunctionTerm(TOTAL_COST, ()):
            pass  # planners without numbers still count the costs of a plan
        case _ if formula.KIND.feature:
            yield Need(formula.KIND.feature)
    for part in formula.children:
        yield from _find_formula_needs(part, is_effect=is_effect)
