"""Finds doubts about a domain: statements that are valid PDDL but useless, such as an impossible action.

The analysis ignores deletions and negative preconditions. Both can only make fewer actions possible, so an
action that the analysis finds impossible is impossible.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import (
    ActionSchema,
    And,
    Atom,
    Domain,
    Formula,
    Not,
    Position,
    Quantified,
    Timed,
    TypedList,
)
from cxbridge.executive.pddl.printer import format_formula
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace

FALSE_PREDICATE: Final = Code(
    "CX311",
    Severity.WARNING,
    "a predicate that is never true",
    "No action makes the predicate true, and no rule makes such a fact: conditions that need the "
    "predicate never hold.",
)
IMPOSSIBLE_ACTION: Final = Code(
    "CX312",
    Severity.WARNING,
    "an action that can never be done",
    "The precondition needs a predicate that nothing makes true before the action: neither a rule, nor an "
    "action that can be done.",
)
UNDONE_EFFECT: Final = Code(
    "CX313",
    Severity.WARNING,
    "an action that undoes its own effect",
    "The action makes an atom true and false at the same time. In PDDL, the atom is true then.",
)
UNTYPED_OBJECT: Final = Code(
    "CX314",
    Severity.WARNING,
    "an object without a type",
    "All parameters of actions have a type, and the object has none: no action takes the object.",
)
UNACHIEVED_GOAL: Final = Code(
    "CX315",
    Severity.WARNING,
    "a planner's goal that no action achieves",
    "The goal of a planner's call needs a predicate that no action has as an effect and that no rule makes: "
    "there is no plan.",
)

CODES: Final = (FALSE_PREDICATE, IMPOSSIBLE_ACTION, UNDONE_EFFECT, UNTYPED_OBJECT, UNACHIEVED_GOAL)


class Doubt(NamedTuple):
    """A useless statement and its position."""

    code: Code
    message: str
    position: Position


def find_domain_doubts(domain: Domain, asserted_predicates: Collection[str] | None = None) -> Iterator[Doubt]:
    """Yield the doubts about a domain.

    :param asserted_predicates: the predicates of facts from rules and problems; None if any fact is possible.
    """
    yield from find_object_doubts(domain, domain.constants)
    for action in domain.actions:
        yield from _find_undone_effects(action)
    if asserted_predicates is None:
        return
    achieved_predicates = {name for action in domain.actions for name in _find_added_predicates(action)}
    for predicate in domain.predicates:
        if predicate.name not in achieved_predicates and predicate.name not in asserted_predicates:
            yield Doubt(
                FALSE_PREDICATE,
                f"({predicate.name}) is never true: no action has it as an effect, nothing else makes it",
                predicate.position,
            )
    yield from _find_impossible_actions(domain, asserted_predicates)


def find_object_doubts(domain: Domain, objects: TypedList) -> Iterator[Doubt]:
    """Yield the objects without a type, if all parameters of actions have a type other than ``object``."""
    groups = [group for action in domain.actions for group in action.parameters]
    # A parameter without a type, or of type `object`, takes any object.
    if not groups or any(not group.types or "object" in group.types for group in groups):
        return
    for group in objects:
        if not group.types:
            message = f"{', '.join(group.names)} has no type: no action takes it"
            yield Doubt(UNTYPED_OBJECT, message, group.position)


def find_goal_doubts(domain: Domain, goal: Formula, asserted_predicates: Collection[str]) -> Iterator[Doubt]:
    """Yield doubts about the atoms of a goal that no action achieves, except those of undeclared predicates.

    :param asserted_predicates: the predicates of facts from rules and problems.
    """
    unachieved_predicates = {predicate.name for predicate in domain.predicates}.difference(
        asserted_predicates, *map(_find_added_predicates, domain.actions)
    )
    for atom in _find_required_atoms(goal):
        if atom.predicate in unachieved_predicates:
            yield Doubt(UNACHIEVED_GOAL, f"no action achieves {format_formula(atom)}", atom.position)


def _find_impossible_actions(domain: Domain, asserted_predicates: Collection[str]) -> Iterator[Doubt]:
    """Yield doubts about the actions whose precondition needs a predicate that nothing makes true before."""
    possible_predicates = set(asserted_predicates)
    blocked_actions = list(domain.actions)
    while ready_actions := [
        action for action in blocked_actions if _find_needed_predicates(action) <= possible_predicates
    ]:
        blocked_actions = [action for action in blocked_actions if action not in ready_actions]
        possible_predicates.update(*map(_find_added_predicates, ready_actions))
    for action in blocked_actions:
        missing_predicates = sorted(_find_needed_predicates(action) - possible_predicates)
        yield Doubt(
            IMPOSSIBLE_ACTION,
            f"the action {action.name} can never be done: "
            f"nothing makes {', '.join(f'({name})' for name in missing_predicates)} true before it",
            action.position,
        )


def _find_needed_predicates(action: ActionSchema) -> set[str]:
    """Return the predicates without which the precondition of an action never holds."""
    return {atom.predicate for atom in _find_required_atoms(action.condition)}


def _find_required_atoms(formula: Formula | None) -> Iterator[Atom]:
    """Yield the atoms that are true whenever a formula holds; none for an alternative such as ``or``."""
    match formula:
        case Atom():
            yield formula
        case And() | Timed() | Quantified(quantifier="exists"):
            for child in formula.children:
                yield from _find_required_atoms(child)


def _find_added_predicates(action: ActionSchema) -> Iterator[str]:
    """Yield the predicates that an action may make true."""
    return (atom.predicate for atom, is_true, _ in _find_effect_literals(action.effect, ()) if is_true)


def _find_effect_literals(
    effect: Formula | None, context: tuple[object, ...]
) -> Iterator[tuple[Atom, bool, tuple[object, ...]]]:
    """Yield each atom of an effect, its truth value, and the enclosing times, ``when`` and ``forall``."""
    match effect:
        case Atom():
            yield effect, True, context
        case Not(part=Atom() as atom):
            yield atom, False, context
        case And():
            for child in effect.children:
                yield from _find_effect_literals(child, context)
        case None:
            return
        case _:
            # The last child is the effect; an earlier child is the condition of `when`.
            time_or_formula = effect.when if isinstance(effect, Timed) else effect
            yield from _find_effect_literals(
                effect.children[-1] if effect.children else None, (*context, time_or_formula)
            )


def _find_undone_effects(action: ActionSchema) -> Iterator[Doubt]:
    """Yield the doubts about atoms that an action makes true and false in the same context."""
    literals = list(_find_effect_literals(action.effect, ()))
    added_literals = {(atom, context) for atom, is_true, context in literals if is_true}
    for atom, is_true, context in literals:
        if not is_true and (atom, context) in added_literals:
            atom_text = format_formula(atom)
            message = f"the action {action.name} makes {atom_text} true and false at once: true wins"
            yield Doubt(UNDONE_EFFECT, message, atom.position)


def make_findings(file: str, doubts: Iterable[Doubt]) -> Iterator[Finding]:
    """Yield doubts about a domain or a problem as findings.

    :param file: the path of the domain or of the problem.
    """
    for code, message, position in doubts:
        yield Finding(code, SourcePlace(file, position.line, position.column), message)
