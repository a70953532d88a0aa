"""Explanation of missing plans: goal parts that no relaxed plan reaches.

A relaxed plan ignores deletions, numbers and times. A goal part that it does not reach is unreachable.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from msgspec.structs import replace

from cxbridge.executive.pddl.ast import (
    ActionSchema,
    And,
    Atom,
    Constant,
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
from cxbridge.executive.pddl.types import ObjectTable
from cxbridge.executive.planning.compile.conditions import Conjunction, Evaluator, Fact
from cxbridge.executive.planning.compile.effects import changed_predicates
from cxbridge.executive.planning.compile.grounding import reachable
from cxbridge.executive.planning.errors import PlanningError

_MOST_ACTIONS: Final = 20_000  # ground actions, above which the explanation would take too long
_MOST_REASONS: Final = 5  # lines of the explanation
_MOST_NAMES: Final = 4  # names in a line


def unreached(domain: Domain, problem: Problem) -> list[str]:
    """Return a line for each unreachable goal part.

    :raises PlanningError: if the problem is too large.
    """
    actions = tuple(_relaxed_action(action) for action in domain.actions)
    relaxed = replace(domain, actions=actions)
    goal = _relaxed(problem.goal)
    found = reachable(relaxed, replace(problem, goal=And(())), _MOST_ACTIONS)
    everything = Evaluator(ObjectTable(domain, problem), lambda _fact: None)
    lasting = _lasting(relaxed, problem)
    missing = [_missing(conjunction, found, lasting) for conjunction in everything.alternatives(goal, {})]
    fewest = min(missing, key=len, default=[])
    lines = [_line(relaxed, fact, to=to) for fact, to in fewest[:_MOST_REASONS]]
    more = len(fewest) - _MOST_REASONS
    return [*lines, f"and {more} more"] if more > 0 else lines


def why_none(domain: Domain, problem: Problem) -> str:
    """Return the lines of :func:`unreached` as the end of a message; empty without a reason."""
    try:
        reasons = unreached(domain, problem)
    except PlanningError:
        return ""
    return f": {'; '.join(reasons)}" if reasons else ""


def _relaxed_action(action: ActionSchema) -> ActionSchema:
    own = frozenset(changed_predicates(action.effect))
    condition = None if action.condition is None else _relaxed(action.condition, own)
    effect = None if action.effect is None else _relaxed(action.effect)
    return replace(action, condition=condition, effect=effect, durative=False, duration=None)


def _relaxed(formula: Formula, own: Collection[str] = ()) -> Formula:
    """Return a formula without times and numbers.

    :param own: predicates changed by the same action, which may satisfy its later conditions.
    """

    def relax(part: Formula) -> Formula:
        match part:
            case Timed(when=when, part=inner) if when != "at start" and _names_one(inner, own):
                return And(())
            case Timed(part=inner):
                return inner
            case TermComparison(left=left, right=right) if _is_number(left) or _is_number(right):
                return And(())
            case Not(part=And(parts=())) | NumericChange():
                return And(())  # a negated comparison
            case _:
                return part

    return formula.map(relax)


def _names_one(formula: Formula, predicates: Collection[str]) -> bool:
    return any(isinstance(part, Atom) and part.predicate in predicates for part in formula.walk())


def _is_number(term: object) -> bool:
    return isinstance(term, FunctionTerm)


def _lasting(domain: Domain, problem: Problem) -> frozenset[Fact]:
    """Return the initial facts that no action can delete."""
    deleting = {
        part.part.predicate
        for action in domain.actions
        for part in (() if action.effect is None else action.effect.walk())
        if isinstance(part, Not) and isinstance(part.part, Atom)
    }
    facts = (Fact(atom.predicate, tuple(_name(term) for term in atom.arguments)) for atom in problem.init)
    return frozenset(fact for fact in facts if fact.predicate not in deleting)


def _name(term: object) -> str:
    return term.name if isinstance(term, Constant) else ""


def _missing(
    conjunction: Conjunction, found: frozenset[Fact], lasting: frozenset[Fact]
) -> list[tuple[Fact, bool]]:
    """Return the facts that prevent a conjunction, with the required truth values."""
    absent = ((fact, True) for fact in sorted(conjunction.positive - found))
    present = ((fact, False) for fact in sorted(conjunction.negative & lasting))
    return [*absent, *present]


def _line(domain: Domain, fact: Fact, *, to: bool) -> str:
    text = f"({' '.join((fact.predicate, *fact.arguments))})"
    if not to:
        return f"nothing deletes {text}"
    names = sorted({action.name for action in domain.actions if _achieves(action, fact)})
    if not names:
        changed = any(fact.predicate in changed_predicates(action.effect) for action in domain.actions)
        why = "no action achieves it for these objects" if changed else f"no action changes {fact.predicate}"
        return f"nothing achieves {text}: {why}"
    more = ", ..." if len(names) > _MOST_NAMES else ""
    return f"nothing achieves {text}: what {', '.join(names[:_MOST_NAMES])}{more} would need is never there"


def _achieves(action: ActionSchema, fact: Fact) -> bool:
    """Return whether an effect of the action can make the fact true."""
    parameters = set(names_of(action.parameters))
    return any(
        isinstance(part, Atom) and part.predicate == fact.predicate and _fits(part, fact, parameters)
        for part in _positive(action.effect)
    )


def _positive(effect: Formula | None) -> Iterator[Formula]:
    """Yield the parts of an effect outside of negations."""
    if effect is None or isinstance(effect, Not):
        return
    yield effect
    for child in effect.children:
        yield from _positive(child)


def _fits(atom: Atom, fact: Fact, parameters: set[str]) -> bool:
    bound: dict[str, str] = {}
    for term, value in zip(atom.arguments, fact.arguments, strict=True):
        if isinstance(term, Variable):
            if term.name in parameters and bound.setdefault(term.name, value) != value:
                return False
        elif _name(term) != value:
            return False
    return True
