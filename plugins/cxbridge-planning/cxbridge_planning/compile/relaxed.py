"""Explanations why a problem has no plan: the parts of the goal that no relaxed plan reaches.

A relaxed plan is a plan of the relaxed domain, whose actions have no deletions, numbers and times. A part of
the goal that the relaxed plan does not reach is unreachable by any plan.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from msgspec.structs import replace

from cxbridge.executive.pddl.ast import (
    ActionSchema,
    And,
    Atom,
    Domain,
    Formula,
    FunctionTerm,
    Not,
    NumericChange,
    Problem,
    TermComparison,
    Timed,
    Variable,
    names_of,
)
from cxbridge_planning.compile.conditions import Evaluator, Fact, fact_of
from cxbridge_planning.compile.effects import changed_predicates
from cxbridge_planning.compile.grounding import reachable
from cxbridge_planning.compile.join import constant_name
from cxbridge_planning.errors import PlanningError
from cxbridge_planning.objects import ObjectTable

_MAX_OPERATORS: Final = 20_000  # ground actions: with more, the explanation would take too long
_MAX_REASONS: Final = 5  # lines of the explanation
_MAX_NAMES: Final = 4  # names in a line


def unreachable_goal_lines(domain: Domain, problem: Problem) -> list[str]:
    """Return a line for each unreachable part of the goal.

    :raises PlanningError: if the problem is too large.
    """
    relaxed = replace(domain, actions=tuple(map(_relax_action, domain.actions)))
    # the goal has no influence on the reachable facts
    facts = reachable(relaxed, replace(problem, goal=And(())), _MAX_OPERATORS)
    permanent = _permanent_facts(relaxed, problem)
    alternatives = Evaluator(ObjectTable(domain, problem), lambda _fact: None).alternatives
    obstacles = [
        [
            *((fact, True) for fact in sorted(conjunction.positive - facts)),
            *((fact, False) for fact in sorted(conjunction.negative & permanent)),
        ]
        for conjunction in alternatives(_relax_formula(problem.goal), {})
    ]
    fewest = min(obstacles, key=len, default=[])
    lines = [_obstacle_line(relaxed, fact, value=value) for fact, value in fewest[:_MAX_REASONS]]
    omitted = len(fewest) - _MAX_REASONS
    return [*lines, f"and {omitted} more"] if omitted > 0 else lines


def no_plan_reason(domain: Domain, problem: Problem) -> str:
    """Return why there is no plan, as the end of a message; empty if the reason is unknown."""
    try:
        reasons = unreachable_goal_lines(domain, problem)
    except PlanningError:
        return ""
    return f": {'; '.join(reasons)}" if reasons else ""


def _relax_action(action: ActionSchema) -> ActionSchema:
    changes = frozenset(changed_predicates(action.effect))
    condition = None if action.condition is None else _relax_formula(action.condition, changes)
    effect = None if action.effect is None else _relax_formula(action.effect)
    return replace(action, condition=condition, effect=effect, durative=False, duration=None)


def _relax_formula(formula: Formula, changes: Collection[str] = ()) -> Formula:
    """Return a formula without times and numbers: a part whose truth depends on a number is true.

    :param changes: predicates that the same action changes, and which may satisfy its conditions after the
        start.
    """

    def relax(part: Formula) -> Formula:
        match part:
            case Timed(when=when, part=inner) if when != "at start" and _mentions(inner, changes):
                return And(())
            case Timed(part=inner):
                return inner
            case TermComparison() if any(isinstance(term, FunctionTerm) for term in part.terms):
                return And(())
            case Not(part=And(parts=())) | NumericChange():
                # map() changes inner parts first: a comparison within a negation is And(()) by now
                return And(())
            case _:
                return part

    return formula.map(relax)


def _mentions(formula: Formula, predicates: Collection[str]) -> bool:
    return any(isinstance(part, Atom) and part.predicate in predicates for part in formula.walk())


def _permanent_facts(domain: Domain, problem: Problem) -> frozenset[Fact]:
    """Return the initial facts that no action can delete."""
    deletable = {
        part.part.predicate
        for action in domain.actions
        for part in (() if action.effect is None else action.effect.walk())
        if isinstance(part, Not) and isinstance(part.part, Atom)
    }
    facts = (fact_of(atom, {}) for atom in problem.init)
    return frozenset(fact for fact in facts if fact.predicate not in deletable)


def _obstacle_line(domain: Domain, fact: Fact, *, value: bool) -> str:
    """Return why a fact never gets a truth value."""
    text = f"({' '.join((fact.predicate, *fact.arguments))})"
    if not value:
        return f"nothing deletes {text}"
    names = sorted({action.name for action in domain.actions if _achieves(action, fact)})
    if not names:
        changed = any(fact.predicate in changed_predicates(action.effect) for action in domain.actions)
        why = "no action achieves it for these objects" if changed else f"no action changes {fact.predicate}"
        return f"nothing achieves {text}: {why}"
    achievers = ", ".join(names[:_MAX_NAMES]) + (", ..." if len(names) > _MAX_NAMES else "")
    return f"nothing achieves {text}: the conditions of {achievers} are never true"


def _achieves(action: ActionSchema, fact: Fact) -> bool:
    """Return whether an effect of the action can make the fact true."""
    parameters = set(names_of(action.parameters))
    return any(
        isinstance(part, Atom) and part.predicate == fact.predicate and _unifies(part, fact, parameters)
        for part in _added_parts(action.effect)
    )


def _added_parts(effect: Formula | None) -> Iterator[Formula]:
    """Yield the parts of an effect outside of negations."""
    if effect is None or isinstance(effect, Not):
        return
    yield effect
    for child in effect.children:
        yield from _added_parts(child)


def _unifies(atom: Atom, fact: Fact, parameters: set[str]) -> bool:
    """Return whether some objects for the parameters turn an atom into the fact."""
    bound: dict[str, str] = {}
    for term, value in zip(atom.arguments, fact.arguments, strict=True):
        if isinstance(term, Variable):
            # a variable of a quantifier takes any object
            if term.name in parameters and bound.setdefault(term.name, value) != value:
                return False
        elif constant_name(term) != value:
            return False
    return True
