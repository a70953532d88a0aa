"""The effects of a ground action: a case for each combination of its conditional effects.

An action with ``(when C E)`` has a case in which ``C`` is true and ``E`` happens, and a case in which ``C``
is false. Each case becomes a STRIPS operator.
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
    Evaluator,
    Fact,
    fact_of,
)
from cxbridge_planning.errors import PlanningError

MAX_CONDITIONS: Final = 8
"""The maximum number of distinct conditions in an action. Each may double the number of cases."""


class Change(NamedTuple):
    """A fact that becomes true or false."""

    fact: Fact
    value: bool


@dataclass(frozen=True, slots=True)
class EffectCase:
    """The changes of a ground action under a condition, which includes the precondition of the action."""

    condition: Conjunction
    changes: frozenset[Change]


def changed_predicates(effect: Formula | None) -> Iterator[str]:
    """Yield the predicates that an effect makes true or false."""
    if isinstance(effect, Atom):
        yield effect.predicate
    elif isinstance(effect, When):
        yield from changed_predicates(effect.effect)
    elif effect is not None:
        for part in effect.children:
            yield from changed_predicates(part)


def effect_cases(
    evaluator: Evaluator, precondition: Conjunction, effect: Formula | None, binding: Binding
) -> Iterator[EffectCase]:
    """Yield the cases of a ground action.

    :param precondition: an alternative of the action's precondition.
    :raises PlanningError: if there are too many conditional effects, or an unsupported effect.
    """
    unconditional: set[Change] = set()
    # changes by the alternatives in which their condition is true, and those in which it is false
    conditional: dict[tuple[Alternatives, Alternatives], set[Change]] = {}
    for condition, inner, change in _changes(evaluator, effect, None, binding):
        if_true = evaluator.alternatives(condition, inner)
        if if_true == TRUE:
            unconditional.add(change)
        elif if_true != FALSE:
            if_false = evaluator.alternatives(condition, inner, negated=True)
            # effects with the same condition share their cases, which keeps the number of cases low
            conditional.setdefault((if_true, if_false), set()).add(change)
    if len(conditional) > MAX_CONDITIONS:
        raise PlanningError(
            f"the conditional effects of an action have more than {MAX_CONDITIONS} different conditions",
            hint="use another planner (fast-downward)",
        )
    yield from _split_case(EffectCase(precondition, frozenset(unconditional)), list(conditional.items()))


def _split_case(
    case: EffectCase, conditional: list[tuple[tuple[Alternatives, Alternatives], set[Change]]]
) -> Iterator[EffectCase]:
    """Yield a case with each consistent combination of further conditions."""
    if not conditional:
        yield case
        return
    (if_true, if_false), conditional_changes = conditional[0]
    for alternatives, changes in ((if_true, conditional_changes), (if_false, set[Change]())):
        for alternative in alternatives:
            condition = case.condition.joined(alternative)
            if condition is not None:
                yield from _split_case(EffectCase(condition, case.changes | changes), conditional[1:])


def _changes(
    evaluator: Evaluator, effect: Formula | None, outer: Formula | None, binding: Binding
) -> Iterator[tuple[Formula | None, Binding, Change]]:
    """Yield the changes of an effect, each with its condition and the objects of its variables.

    :param outer: the condition of the effect itself; None without a condition.
    """
    match effect:
        case None | NumericChange():  # STRIPS has no numbers, and the planner ignores costs
            return
        case And(parts=parts):
            for part in parts:
                yield from _changes(evaluator, part, outer, binding)
        case Quantified(quantifier="forall", variables=variables, part=part):
            for inner in evaluator.bindings(variables, binding):
                yield from _changes(evaluator, part, outer, inner)
        case When(condition=condition, effect=part):
            nested = condition if outer is None else And((outer, condition))
            yield from _changes(evaluator, part, nested, binding)
        case Atom():
            yield outer, binding, Change(fact_of(effect, binding), value=True)
        case Not(part=Atom() as atom):
            yield outer, binding, Change(fact_of(atom, binding), value=False)
        case _:
            raise PlanningError(f"an effect cannot contain {type(effect).__name__}")
