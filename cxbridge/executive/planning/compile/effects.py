"""The effects of a ground action: one case per combination of its conditional effects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import And, Atom, Formula, Not, NumericChange, Quantified, When
from cxbridge.executive.planning.compile.conditions import (
    FALSE,
    TRUE,
    Alternatives,
    Binding,
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
    """A condition and its changes."""

    condition: Conjunction
    changes: frozenset[Change]


def changed_predicates(effect: Formula | None) -> Iterator[str]:
    if isinstance(effect, Atom):
        yield effect.predicate
    elif isinstance(effect, When):
        yield from changed_predicates(effect.effect)
    elif effect is not None:
        for part in effect.children:
            yield from changed_predicates(part)


def cases(
    evaluator: Evaluator, condition: Conjunction, effect: Formula | None, binding: Binding
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
    for alternatives, extra in ((holds, frozenset(changes)), (fails, frozenset[Change]())):
        for alternative in alternatives:
            both = case.condition.joined(alternative)
            if both is not None:
                yield from _split(Case(both, case.changes | extra), conditional[1:])


def _changes(
    evaluator: Evaluator, effect: Formula | None, when: Formula | None, binding: Binding
) -> Iterator[tuple[Formula | None, Binding, Change]]:
    match effect:
        case None | NumericChange():
            return
        case And(parts=parts):
            for part in parts:
                yield from _changes(evaluator, part, when, binding)
        case Quantified(quantifier="forall", variables=variables, part=part):
            for inner in evaluator.bindings(variables, binding):
                yield from _changes(evaluator, part, when, inner)
        case When(condition=condition, effect=part):
            both = condition if when is None else And((when, condition))
            yield from _changes(evaluator, part, both, binding)
        case Atom():
            yield when, binding, Change(fact_of(effect, binding), to=True)
        case Not(part=Atom() as atom):
            yield when, binding, Change(fact_of(atom, binding), to=False)
        case _:
            raise PlanningError(f"an effect cannot hold {type(effect).__name__}")
