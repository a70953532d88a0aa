"""Explanations of why a problem has no plan: the facts of the goal that no relaxed plan reaches.

A relaxed plan is a plan of the relaxed domain, whose actions have no deletions, numbers or times. A fact that
no relaxed plan reaches is unreachable by any plan.
"""

from __future__ import annotations

from collections.abc import Collection
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
    Or,
    Problem,
    TermComparison,
    Timed,
)
from cxbridge.executive.pddl.printer import format_list
from cxbridge_planning.compile.conditions import DnfConverter, Fact
from cxbridge_planning.compile.effects import find_changed_predicates
from cxbridge_planning.compile.grounding import find_reachable_facts
from cxbridge_planning.errors import PlanningError
from cxbridge_planning.objects import ObjectTable

_MAX_OPERATORS: Final = 20_000  # ground actions: with more, the explanation would take too long
_MAX_REASONS: Final = 5  # lines of the explanation


def unreachable_goal_lines(domain: Domain, problem: Problem) -> list[str]:
    """Return lines about the unreachable facts of the goal's easiest alternative, at most five.

    There is no line if a relaxed plan reaches the goal.

    :raises PlanningError: if the problem is too large, or a formula is not supported.
    """
    relaxed_domain = replace(domain, actions=tuple(map(_relax_action, domain.actions)))
    # the goal has no influence on the reachable facts
    facts = find_reachable_facts(relaxed_domain, replace(problem, goal=And(())), _MAX_OPERATORS)
    # no fact is evaluated in advance, so that the alternatives name all facts
    converter = DnfConverter(ObjectTable(domain, problem), lambda _fact: None)
    alternatives = converter.find_alternatives(_relax_formula(problem.goal), {})
    missing_facts_by_alternative = [sorted(conjunction.positive - facts) for conjunction in alternatives]
    # the alternative with the fewest unreachable facts is the easiest to mend
    obstacles = min(missing_facts_by_alternative, key=len, default=[])
    return [_describe_obstacle(relaxed_domain, fact) for fact in obstacles[:_MAX_REASONS]]


def no_plan_reason(domain: Domain, problem: Problem) -> str:
    """Return why there is no plan, as the end of a message; empty if the reason is unknown."""
    try:
        reasons = unreachable_goal_lines(domain, problem)
    except PlanningError:
        return ""
    return f": {'; '.join(reasons)}" if reasons else ""


def _relax_action(action: ActionSchema) -> ActionSchema:
    """Return an action without times and numbers; :func:`find_reachable_facts` ignores its deletions."""
    changed_predicates = frozenset(find_changed_predicates(action.effect))
    condition = None if action.condition is None else _relax_formula(action.condition, changed_predicates)
    effect = None if action.effect is None else _relax_formula(action.effect)
    return replace(action, condition=condition, effect=effect, is_durative=False, duration=None)


def _relax_formula(formula: Formula, changed_predicates: Collection[str] = ()) -> Formula:
    """Return a formula without times and numbers: a part whose truth depends on a number is true.

    :param changed_predicates: the predicates that the action of the formula changes. A condition after the
        action's start that has such a predicate may become true by the action itself, and so counts as true.
    """

    def relax(part: Formula) -> Formula:
        match part:
            case Timed(when=when, part=timed_part) if when != "at start" and _mentions(
                timed_part, changed_predicates
            ):
                return And(())
            case Timed(part=timed_part):
                return timed_part
            case NumericChange():
                return And(())
            case _:
                return And(()) if _depends_on_number(part) else part

    return formula.map(_reduce_numeric_negation).map(relax)


def _reduce_numeric_negation(part: Formula) -> Formula:
    """Replace a negation, disjunction or implication that compares numbers by its first comparison.

    The truth of such a part depends on a number, so that it counts as true, like the comparison alone.
    """
    if isinstance(part.reduced, Not | Or):
        return next(filter(_depends_on_number, part.reduced.walk()), part)
    return part


def _depends_on_number(formula: Formula) -> bool:
    return isinstance(formula, TermComparison) and any(
        isinstance(term, FunctionTerm) for term in formula.terms
    )


def _mentions(formula: Formula, predicates: Collection[str]) -> bool:
    return any(isinstance(part, Atom) and part.predicate in predicates for part in formula.walk())


def _describe_obstacle(domain: Domain, fact: Fact) -> str:
    """Return why a fact never becomes true."""
    is_changed = any(fact.predicate in find_changed_predicates(action.effect) for action in domain.actions)
    reason = "" if is_changed else f": no action changes {fact.predicate}"
    return f"nothing achieves {format_list(fact.predicate, *fact.arguments)}{reason}"
