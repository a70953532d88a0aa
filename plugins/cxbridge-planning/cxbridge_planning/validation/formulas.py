"""Conditions and effects of a ground action at the moments of a plan.

PDDL 2.1 gives each part of a durative action a time: ``at start``, ``at end`` or ``over all``. A moment is
a time in a plan, with the state at that time. As an effect at the end may have a condition at the start, the
moment of an end refers to the moment of the start.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

from msgspec.structs import replace

from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Binding,
    Formula,
    FunctionTerm,
    Ground,
    Not,
    NumericChange,
    Quantified,
    Timed,
    When,
)
from cxbridge.executive.pddl.printer import format_formula, format_number, format_term
from cxbridge.executive.problem.truth import KnownState, bind_term, blamed_parts
from cxbridge_planning.compile.conditions import fact_of
from cxbridge_planning.errors import PlanningError
from cxbridge_planning.objects import ObjectTable
from cxbridge_planning.validation.world import Changes, RecordingFacts, RecordingNumbers, WorldState

AT_START: Final = "at start"
AT_END: Final = "at end"
OVER_ALL: Final = "over all"


class _BoundEffect(NamedTuple):
    """A literal or numeric effect with the objects of its variables.

    :param becomes_true: whether an atom becomes true rather than false; without a meaning for numbers.
    """

    effect: Atom | NumericChange
    binding: Binding
    becomes_true: bool = True


@dataclass(frozen=True, slots=True)
class Moment:
    """A time in a plan at which conditions are evaluated or effects happen.

    :param state: the state at that time, before the effects.
    :param duration: the duration of the action; None for an action without duration.
    :param start: the moment of the action's start, for ``at start`` conditions of ``at end`` effects.
    """

    state: WorldState
    objects: ObjectTable
    duration: float | None = None
    start: Moment | None = None

    def known_state(self) -> KnownState:
        """Return the state in the form in which conditions are evaluated."""
        return KnownState(self.state.facts, self.state.numbers, self.objects.of_types, self.duration)

    def reads_of(self, formulas: Iterable[Formula], binding: Binding) -> tuple[set[Ground], set[Ground]]:
        """Return the facts that conditions read as true, and all other facts and functions that they read."""
        facts, numbers = RecordingFacts(self.state.facts), RecordingNumbers(self.state.numbers)
        state = KnownState(facts, numbers, self.objects.of_types, self.duration)
        for formula in formulas:
            formula.holds(state, binding)
        return facts.true_reads, facts.false_reads | numbers.reads


def parts_at(formula: Formula | None, time: str) -> Iterator[Formula]:
    """Yield the parts of a condition that must be true at a time.

    :param time: :data:`AT_START`, :data:`AT_END` or :data:`OVER_ALL`. A part without time belongs to the
        start.
    """
    match formula:
        case None:
            return
        case And(parts=parts):
            for part in parts:
                yield from parts_at(part, time)
        case Timed(when=when, part=part):
            if when == time:
                yield from parts_at(part, AT_START)  # the inner part has no time
        case Quantified(quantifier="forall", part=part) if _has_times(part):
            for inner_part in parts_at(part, time):
                yield replace(formula, part=inner_part)
        case _ if time == AT_START:
            yield formula


def _has_times(formula: Formula) -> bool:
    """Return whether parts of a condition have times."""
    match formula:
        case Timed():
            return True
        case And(parts=parts):
            return any(map(_has_times, parts))
        case Quantified(part=part):
            return _has_times(part)
        case _:
            return False


def describe_false_part(formula: Formula, binding: Binding, moment: Moment) -> str:
    """Return a text about the smallest false part of a formula; empty if the formula is true."""
    state = moment.known_state()
    blamed_part = next(blamed_parts(formula, state, binding, keeps_choices=True), None)
    if blamed_part is None:
        return ""
    part, inner_binding = blamed_part.formula, blamed_part.binding
    if isinstance(part, Not):
        return f"{_format_bound(part.part, inner_binding)} is true"
    functions = (term for term in part.terms if isinstance(term, FunctionTerm))
    values = ", ".join(_describe_value(term, inner_binding, state) for term in functions)
    return f"{_format_bound(part, inner_binding)} is false" + (f": {values}" if values else "")


def _describe_value(term: FunctionTerm, binding: Binding, state: KnownState) -> str:
    value = state.number(term, binding)
    text = "has no value" if value is None else f"is {format_number(value)}"
    return f"{format_term(bind_term(term, binding))} {text}"


def _format_bound(formula: Formula, binding: Binding) -> str:
    """Return the text of a formula with objects in place of variables."""
    return format_formula(formula.map_terms(lambda term: bind_term(term, binding)))


def effect_changes(effect: Formula | None, binding: Binding, moment: Moment, time: str) -> Changes:
    """Return the changes of an effect.

    :param time: :data:`AT_START` or :data:`AT_END`, which includes effects without time.
    :raises CxbridgeError: if a number has no value, the effect is continuous, or the condition of an effect
        has a part ``over all``.
    """
    changes = Changes()
    state = moment.known_state()
    for change in _find_effects(effect, binding, moment, AT_END, time):
        if isinstance(change.effect, NumericChange):
            state.change_number(change.effect, change.binding, changes.numbers)
        else:
            (changes.adds if change.becomes_true else changes.deletes).add(
                fact_of(change.effect, change.binding)
            )
    changes.deletes.difference_update(changes.adds)  # a fact that is deleted and added is true afterwards
    return changes


def _find_effects(  # noqa: C901, PLR0912  a case for each kind of formula
    effect: Formula | None, binding: Binding, moment: Moment, time: str, moment_time: str
) -> Iterator[_BoundEffect]:
    """Yield the effects that happen at a moment: they have its time, and their conditions are true.

    :param time: the time of parts without ``at start`` or ``at end``.
    :param moment_time: the time of the moment.
    """
    match effect:
        case And(parts=parts):
            for part in parts:
                yield from _find_effects(part, binding, moment, time, moment_time)
        case Timed(when=when, part=part):
            yield from _find_effects(part, binding, moment, when, moment_time)
        case Quantified(quantifier="forall", variables=variables, part=part):
            for inner_binding in moment.known_state().bindings(variables, binding):
                yield from _find_effects(part, inner_binding, moment, time, moment_time)
        case When(condition=condition, effect=part):
            effects = list(_find_effects(part, binding, moment, time, moment_time))
            # the condition of an effect at the other time is not evaluated
            if effects and _condition_holds(condition, binding, moment):
                yield from effects
        case Not(part=Atom() as atom):
            if time == moment_time:
                yield _BoundEffect(atom, binding, becomes_true=False)
        case Atom() | NumericChange():
            if time == moment_time:
                yield _BoundEffect(effect, binding)
        case _ if effect is not None and not effect.KIND.is_condition:
            raise NotImplementedError(f"the effects of {type(effect).__name__}")
        case _:
            return  # conditions have no effects: cxbridge reads them in effects, as Fawkes does


def _condition_holds(condition: Formula, binding: Binding, moment: Moment) -> bool:
    """Return whether the condition of an effect is true. Its ``at start`` parts refer to the start.

    :raises PlanningError: if a part has the time ``over all``.
    """
    if not _has_times(condition):
        return condition.holds(moment.known_state(), binding)
    if next(parts_at(condition, OVER_ALL), None) is not None:
        raise PlanningError("a conditional effect with a condition 'over all' cannot be checked")
    start = moment.start or moment
    return all(part.holds(start.known_state(), binding) for part in parts_at(condition, AT_START)) and all(
        part.holds(moment.known_state(), binding) for part in parts_at(condition, AT_END)
    )
