"""Finds doubts about a domain: statements that are valid PDDL but useless, such as an impossible action.

The analysis ignores deletions and negative preconditions: an action that is impossible even then is
impossible.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
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
from cxbridge_studio.check.findings import Code, Severity

PREDICATE: Final = Code(
    "CX311",
    Severity.WARNING,
    "a predicate that is never true",
    "No action has the predicate as an effect, and no rule makes such a fact: conditions with the "
    "predicate never hold.",
)
ACTION: Final = Code(
    "CX312",
    Severity.WARNING,
    "an action that can never be done",
    "The precondition needs a predicate that nothing makes true before the action: neither a rule, nor an "
    "action that can be done.",
)
EFFECT: Final = Code(
    "CX313",
    Severity.WARNING,
    "an action that takes its own effect back",
    "The action makes an atom true and false at the same time. In PDDL, the atom is true then.",
)
OBJECT: Final = Code(
    "CX314",
    Severity.WARNING,
    "an object without a type",
    "All parameters of actions have a type, and the object has none: no action takes the object.",
)
GOAL: Final = Code(
    "CX315",
    Severity.WARNING,
    "a planner's goal that no action achieves",
    "The goal of a planner's call needs a predicate that no action has as an effect and that no rule makes: "
    "there is no plan.",
)

CODES: Final = (PREDICATE, ACTION, EFFECT, OBJECT, GOAL)


class Doubt(NamedTuple):
    """A useless statement and its position."""

    code: Code
    message: str
    position: Position


def of_domain(domain: Domain, made: Collection[str] | None = None) -> Iterator[Doubt]:
    """Yield the doubts about a domain.

    :param made: the predicates of facts from rules and problems; None if any predicate is possible.
    """
    yield from of_objects(domain, domain.constants)
    for action in domain.actions:
        yield from _undone_effects(action)
    if made is None:
        return
    achieved = {name for action in domain.actions for name in _added_predicates(action)}
    for predicate in domain.predicates:
        if predicate.name not in achieved and predicate.name not in made:
            message = (
                f"({predicate.name}) is never true: no action has it as an effect, nothing else makes it"
            )
            yield Doubt(PREDICATE, message, predicate.position)
    yield from _impossible_actions(domain, made)


def of_objects(domain: Domain, objects: TypedList) -> Iterator[Doubt]:
    """Yield the objects without a type, if all parameters of actions have one."""
    groups = [group for action in domain.actions for group in action.parameters]
    if not groups or not all(group.types for group in groups):
        return
    if any(type_ == "object" for group in groups for type_ in group.types):
        return  # a parameter of type `object` takes any object
    for group in objects:
        if not group.types:
            message = f"{', '.join(group.names)} has no type: no action takes it"
            yield Doubt(OBJECT, message, group.position)


def of_goal(domain: Domain, goal: Formula, made: Collection[str]) -> Iterator[Doubt]:
    """Yield the atoms of a goal that no action achieves, except atoms of undeclared predicates.

    :param made: the predicates of facts from rules and problems.
    """
    declared = {predicate.name for predicate in domain.predicates}
    achieved = {name for action in domain.actions for name in _added_predicates(action)}
    for atom in _required(goal):
        if atom.predicate in declared - achieved - set(made):
            yield Doubt(GOAL, f"no action achieves {format_formula(atom)}", atom.position)


def _impossible_actions(domain: Domain, made: Collection[str]) -> Iterator[Doubt]:
    """Yield the actions whose precondition needs a predicate that no sequence of actions makes true."""
    possible = set(made)
    blocked = list(domain.actions)
    while ready := [action for action in blocked if _needs(action) <= possible]:
        blocked = [action for action in blocked if action not in ready]
        possible.update(name for action in ready for name in _added_predicates(action))
    for action in blocked:
        missing = ", ".join(f"({name})" for name in sorted(_needs(action) - possible))
        message = f"the action {action.name} can never be done: nothing makes {missing} true before it"
        yield Doubt(ACTION, message, action.position)


def _needs(action: ActionSchema) -> set[str]:
    return {atom.predicate for atom in _required(action.condition)}


def _required(formula: Formula | None) -> Iterator[Atom]:
    """Yield atoms that are true whenever a formula holds; alternatives such as ``or`` have no such atoms."""
    match formula:
        case Atom():
            yield formula
        case And() | Timed() | Quantified(quantifier="exists"):
            for child in formula.children:
                yield from _required(child)
        case _:
            return


def _added_predicates(action: ActionSchema) -> Iterator[str]:
    """Yield the predicates that an action may make true."""
    for atom, is_true, _ in _literals(action.effect, ()):
        if is_true:
            yield atom.predicate


def _literals(
    effect: Formula | None, context: tuple[object, ...]
) -> Iterator[tuple[Atom, bool, tuple[object, ...]]]:
    """Yield each atom of an effect, its truth value, and the enclosing times and conditions."""
    match effect:
        case Atom():
            yield effect, True, context
        case Not(part=Atom() as atom):
            yield atom, False, context
        case And():
            for child in effect.children:
                yield from _literals(child, context)
        case None:
            return
        case _:
            # The last child is the effect; an earlier child is the condition of `when`.
            enclosing = effect.when if isinstance(effect, Timed) else effect
            yield from _literals(effect.children[-1] if effect.children else None, (*context, enclosing))


def _undone_effects(action: ActionSchema) -> Iterator[Doubt]:
    """Yield the doubts about atoms that an action makes true and false in the same context."""
    literals = list(_literals(action.effect, ()))
    added = {(atom, context) for atom, is_true, context in literals if is_true}
    for atom, is_true, context in literals:
        if not is_true and (atom, context) in added:
            message = f"the action {action.name} makes {format_formula(atom)} true and false at once"
            yield Doubt(EFFECT, f"{message}: true wins", atom.position)
