"""Doubts about a domain: statements that are valid PDDL but useless, such as an impossible action."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from enum import Enum
from typing import NamedTuple

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


class DoubtKind(Enum):
    PREDICATE = "predicate"
    ACTION = "action"
    EFFECT = "effect"
    OBJECT = "object"
    GOAL = "goal"


class Doubt(NamedTuple):
    """A useless statement and its position."""

    kind: DoubtKind
    message: str
    position: Position


def doubts(domain: Domain, made: Collection[str] | None = None) -> Iterator[Doubt]:
    """Yield the doubts about a domain.

    :param made: the predicates of facts from rules and problems; None if any predicate is possible.
    """
    yield from untyped_objects(domain, domain.constants)
    for action in domain.actions:
        yield from _undone(action)
    if made is None:
        return
    changed = {name for action in domain.actions for name in _added(action)}
    for predicate in domain.predicates:
        if predicate.name not in changed and predicate.name not in made:
            message = (
                f"({predicate.name}) is never true: no action has it as an effect, nothing else makes it"
            )
            yield Doubt(DoubtKind.PREDICATE, message, predicate.position)
    yield from _unreachable(domain, made)


def untyped_objects(domain: Domain, objects: TypedList) -> Iterator[Doubt]:
    """Yield the objects without a type, if all parameters of actions have one."""
    groups = [group for action in domain.actions for group in action.parameters]
    if not groups or not all(group.types for group in groups):
        return
    if any(type_ == "object" for group in groups for type_ in group.types):
        return
    for group in objects:
        if not group.types:
            message = f"{', '.join(group.names)} has no type: no action takes it"
            yield Doubt(DoubtKind.OBJECT, message, group.position)


def unachieved(domain: Domain, goal: Formula, made: Collection[str]) -> Iterator[Doubt]:
    """Yield the atoms of a goal that no action achieves, except atoms of undeclared predicates.

    :param made: the predicates of facts from rules and problems.
    """
    known = {predicate.name for predicate in domain.predicates}
    changed = {name for action in domain.actions for name in _added(action)}
    for atom in _required(goal):
        if atom.predicate in known - changed - set(made):
            yield Doubt(DoubtKind.GOAL, f"no action achieves {format_formula(atom)}", atom.position)


def _unreachable(domain: Domain, made_predicates: Collection[str]) -> Iterator[Doubt]:
    """Yield the actions whose precondition needs a predicate that no sequence of actions makes true."""
    possible = set(made_predicates)
    waiting = list(domain.actions)
    while ready := [each for each in waiting if _needs(each) <= possible]:
        waiting = [each for each in waiting if each not in ready]
        possible.update(name for action in ready for name in _added(action))
    for action in waiting:
        missing = ", ".join(f"({name})" for name in sorted(_needs(action) - possible))
        message = f"the action {action.name} can never be done: nothing makes {missing} true before it"
        yield Doubt(DoubtKind.ACTION, message, action.position)


def _needs(action: ActionSchema) -> set[str]:
    return {atom.predicate for atom in _required(action.condition)}


def _required(formula: Formula | None) -> Iterator[Atom]:
    """Yield the atoms that are true whenever the condition holds."""
    match formula:
        case Atom():
            yield formula
        case And() | Timed() | Quantified(quantifier="exists"):
            for part in formula.children:
                yield from _required(part)
        case _:
            return


def _added(action: ActionSchema) -> Iterator[str]:
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
            for part in effect.children:
                yield from _literals(part, context)
        case None:
            return
        case _:
            around = effect.when if isinstance(effect, Timed) else effect
            yield from _literals(effect.children[-1] if effect.children else None, (*context, around))


def _undone(action: ActionSchema) -> Iterator[Doubt]:
    """Yield the effects of an action that the same action also negates."""
    literals = list(_literals(action.effect, ()))
    added = {(atom, context) for atom, is_true, context in literals if is_true}
    for atom, is_true, context in literals:
        if not is_true and (atom, context) in added:
            message = f"the action {action.name} makes {format_formula(atom)} true and false at once"
            yield Doubt(DoubtKind.EFFECT, f"{message}: true wins", atom.position)
