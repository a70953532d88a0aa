"""The effects of a ground action: one case per combination of its conditional effects.

An action with ``(when C E)`` has a case in which ``C`` holds and ``E`` happens, and a case in which ``C``
does not hold. A STRIPS operator is made of each case.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import And, Atom, Bound, Formula, Not, NumericChange, Quantified, When
from cxbridge.executive.planning.compile.conditions import (
    FALSE,
    TRUE,
    Alternatives,
    Conjunction,
    Evaluator,
    Fact,
    fact_of,
)
from cxbridge.executive.planning.errors import PlanningError

MAX_CONDITIONS: Final = 8
"""The maximum number of conditional effects. Each may double the number of cases."""


class Change(NamedTuple):
    """A fact that becomes true or false."""

    fact: Fact
    to: bool


@dataclass(frozen=True, slots=True)
class Case:
    """The changes of an action under a condition."""

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


def cases(
    evaluator: Evaluator, condition: Conjunction, effect: Formula | None, binding: Bound
) -> Iterator[Case]:
    """Yield the cases of an action with a precondition.

    :raises PlanningError: if there are too many conditional effects, or an unsupported one.
    """
    always: set[Change] = set()
    conditional: dict[tuple[Alternatives, Alternatives], set[Change]] = {}
    for when, inner, change in _changes(evaluator, effect, None, binding):
        holds = evaluator.alternatives(when, inner)
        if holds == TRUE:
            always.add(change)
        elif holds != FALSE:
            fails = evaluator.alternatives(when, inner, negated=True)
            # effects with the same condition share their cases, which keeps the number of cases low
            conditional.setdefault((holds, fails), set()).add(change)
    if len(conditional) > MAX_CONDITIONS:
        raise PlanningError(
            f"an action has conditional effects with more than {MAX_CONDITIONS} conditions at once",
            hint="use another planner (fast-downward)",
        )
    yield from _split(Case(condition, frozenset(always)), list(conditional.items()))


def _split(
    case: Case, conditional: list[tuple[tuple[Alternatives, Alternatives], set[Change]]]
) -> Iterator[Case]:
    if not conditional:
        yield case
        return
    (holds, fails), changes = conditional[0]
    for alternatives, effects in ((holds, changes), (fails, set[Change]())):
        for alternative in alternatives:
            condition = case.condition.joined(alternative)
            if condition is not None:
                yield from _split(Case(condition, case.changes | effects), conditional[1:])


def _changes(
    evaluator: Evaluator, effect: Formula | None, when: Formula | None, binding: Bound
) -> Iterator[tuple[Formula | None, Bound, Change]]:
    """Yield the changes of an effect, each with its condition and the objects of its variables."""
    match effect:
        case None | NumericChange():  # STRIPS has no numbers, and the planner ignores costs
            return
        case And(parts=parts):
            for part in parts:
                yield from _changes(evaluator, part, when, binding)
        case Quantified(quantifier="forall", variables=variables, part=part):
            for inner in evaluator.bindings(variables, binding):
                yield from _changes(evaluator, part, when, inner)
        case When(condition=condition, effect=part):
            nested = condition if when is None else And((when, condition))
            yield from _changes(evaluator, part, nested, binding)
        case Atom():
            yield when, binding, Change(fact_of(effect, binding), to=True)
        case Not(part=Atom() as atom):
            yield when, binding, Change(fact_of(atom, binding), to=False)
        case _:
            raise PlanningError(f"an effect cannot hold {type(effect).__name__}")
