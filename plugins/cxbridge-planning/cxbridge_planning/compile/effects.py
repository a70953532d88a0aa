"""The effects of a ground action: a case for each combination of its conditional effects.

An action with ``(when C E)`` has a case in which ``C`` is true and ``E`` happens, and a case in which ``C``
is false; a condition with alternatives has several cases. Each case becomes a STRIPS operator.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import And, Atom, Binding, Formula, Not, NumericChange, Quantified, When
from cxbridge_planning.compile.conditions import (
    FALSE,
    TRUE,
    Alternatives,
    Conjunction,
    DnfConverter,
    Fact,
    fact_of,
)
from cxbridge_planning.errors import PlanningError

MAX_CONDITIONS: Final = 8
"""The maximum number of distinct conditions in an action. Each may multiply the cases, usually by two."""


# the alternatives in which the condition of an effect is true, and those in which it is false
_SplitCondition = tuple[Alternatives, Alternatives]


class Change(NamedTuple):
    """A fact that becomes true or false."""

    fact: Fact
    becomes_true: bool


@dataclass(frozen=True, slots=True)
class EffectCase:
    """The changes of a ground action under a condition, which includes the precondition of the action."""

    condition: Conjunction
    changes: frozenset[Change]


def find_changed_predicates(effect: Formula | None) -> Iterator[str]:
    """Yield the predicates that an effect makes true or false."""
    if isinstance(effect, Atom):
        yield effect.predicate
    elif isinstance(effect, When):
        yield from find_changed_predicates(effect.effect)
    elif effect is not None:
        for part in effect.children:
            yield from find_changed_predicates(part)


def find_effect_cases(
    converter: DnfConverter, precondition: Conjunction, effect: Formula | None, binding: Binding
) -> Iterator[EffectCase]:
    """Yield the cases of a ground action.

    :param precondition: an alternative of the action's precondition.
    :raises PlanningError: if the effects have too many different conditions, or an effect is unsupported.
    """
    unconditional_changes: set[Change] = set()
    changes_by_condition: dict[_SplitCondition, set[Change]] = {}
    for condition, inner_binding, change in _find_changes(converter, effect, None, binding):
        if_true = converter.find_alternatives(condition, inner_binding)
        if if_true == TRUE:
            unconditional_changes.add(change)
        elif if_true != FALSE:
            if_false = converter.find_alternatives(condition, inner_binding, is_negated=True)
            # effects with the same condition share their cases, which keeps the number of cases low
            changes_by_condition.setdefault((if_true, if_false), set()).add(change)
    if len(changes_by_condition) > MAX_CONDITIONS:
        raise PlanningError(
            f"the conditional effects of an action have more than {MAX_CONDITIONS} different conditions",
            hint="use another planner (fast-downward)",
        )
    case = EffectCase(precondition, frozenset(unconditional_changes))
    yield from _split_case(case, list(changes_by_condition.items()))


def _split_case(
    case: EffectCase, conditional_changes: list[tuple[_SplitCondition, set[Change]]]
) -> Iterator[EffectCase]:
    """Yield a case with each consistent combination of further conditions.

    :param conditional_changes: each further condition with its changes.
    """
    if not conditional_changes:
        yield case
        return
    ((if_true, if_false), changes_if_true), *remaining_changes = conditional_changes
    for alternatives, changes in ((if_true, changes_if_true), (if_false, set[Change]())):
        for alternative in alternatives:
            condition = case.condition.join(alternative)
            if condition is not None:
                yield from _split_case(EffectCase(condition, case.changes | changes), remaining_changes)


def _find_changes(
    converter: DnfConverter, effect: Formula | None, outer_condition: Formula | None, binding: Binding
) -> Iterator[tuple[Formula | None, Binding, Change]]:
    """Yield the changes of an effect, each with its condition and the objects of its variables.

    :param outer_condition: the condition of the whole effect; None without a condition.
    """
    match effect:
        case None | NumericChange():  # STRIPS has no numbers, and the planner ignores costs
            return
        case And(parts=parts):
            for part in parts:
                yield from _find_changes(converter, part, outer_condition, binding)
        case Quantified(quantifier="forall", variables=variables, part=part):
            for inner_binding in converter.extend_binding(variables, binding):
                yield from _find_changes(converter, part, outer_condition, inner_binding)
        case When(condition=condition, effect=part):
            whole_condition = condition if outer_condition is None else And((outer_condition, condition))
            yield from _find_changes(converter, part, whole_condition, binding)
        case Atom():
            yield outer_condition, binding, Change(fact_of(effect, binding), becomes_true=True)
        case Not(part=Atom() as atom):
            yield outer_condition, binding, Change(fact_of(atom, binding), becomes_true=False)
        case _:
            raise PlanningError(f"an effect cannot contain {type(effect).__name__}")
