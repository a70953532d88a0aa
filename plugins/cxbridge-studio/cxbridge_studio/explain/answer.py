"""Explains a rule, a goal, a plan-action or a fact by its name, or the whole run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge_studio.explain import facts, goal_report, run_story
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_rules import makers
from cxbridge_studio.explain.rules import report as rule_report
from cxbridge_studio.explain.rules.lost import refused, unloaded

# The kinds of things that can be explained; `run` has no name.
KINDS: Final = ("rule", "goal", "action", "fact", "run")

_NO_GOAL: Final = "there is no goal"


@dataclass(frozen=True, slots=True)
class Explanation:
    """A report.

    :param lines: the report as text.
    :param plain: the report as JSON values.
    """

    lines: tuple[str, ...]
    plain: dict[str, Any]


def explain(evidence: Evidence, name: str, kind: str = "", rules: int = 1) -> Explanation:
    """Explain something of a run.

    :param kind: one of :data:`KINDS`, or empty to try in order: an existing rule, a goal, a missing rule.
    :param rules: the number of rules to list before each step of a goal.
    :raises CxbridgeError: if the name is unknown, or its state cannot be explained.
    """
    match kind:
        case "goal":
            return _goal(evidence, name, rules)
        case "rule":
            return _rule(evidence, name)
        case "action":
            return _action(evidence, name)
        case "fact":
            return _fact(evidence, name)
        case "run":
            return _run(evidence)
        case _:
            return _of_any_kind(evidence, name, rules)


def _of_any_kind(evidence: Evidence, name: str, rules: int) -> Explanation:
    """Explain a rule, or else a goal."""
    try:
        known = name in evidence.rulebook().rules
    except CxbridgeError as no_rules:
        return _goal_without_rules(evidence, name, rules, no_rules)
    if known:
        return _rule(evidence, name)
    try:
        return _goal(evidence, name, rules)
    except CxbridgeError as error:
        no_goal = error
    try:
        return _rule(evidence, name)
    except CxbridgeError as no_rule:
        raise _neither(name, no_rule, no_goal) from None


def _goal_without_rules(evidence: Evidence, name: str, rules: int, no_rules: CxbridgeError) -> Explanation:
    """Explain a goal of an environment whose rules are unknown.

    :param no_rules: why the rules are unknown.
    """
    try:
        return _goal(evidence, name, rules)
    except CxbridgeError as no_goal:
        if not no_goal.message.startswith(_NO_GOAL):
            raise
        message = f"{no_goal.message}; as to rules: {no_rules.message}"
        raise type(no_rules)(message, file=no_rules.file, hint=no_rules.hint) from None


def _rule(evidence: Evidence, name: str) -> Explanation:
    story = rule_report.explain_rule(evidence, name)
    return Explanation(tuple(rule_report.lines(story)), rule_report.plain(story))


def _goal(evidence: Evidence, name: str, rules: int) -> Explanation:
    try:
        stories = goal_report.explain_goals(evidence, name)
    except CxbridgeError as no_goal:
        never = _never_formulated(evidence, name) if no_goal.message.startswith(_NO_GOAL) else None
        if never is None:
            raise
        return never
    return Explanation(
        tuple(goal_report.lines(stories, evidence, rules)), goal_report.plain(stories, evidence)
    )


def _action(evidence: Evidence, name: str) -> Explanation:
    stories = goal_report.explain_actions(evidence, name)
    return Explanation(
        tuple(goal_report.action_lines(stories, evidence)), goal_report.plain_actions(stories, evidence)
    )


def _fact(evidence: Evidence, name: str) -> Explanation:
    story = facts.explain_fact(evidence, name)
    return Explanation(tuple(facts.lines(story)), facts.plain(story))


def _run(evidence: Evidence) -> Explanation:
    story = run_story.tell_run(evidence)
    return Explanation(tuple(run_story.lines(story)), run_story.plain(story))


def _never_formulated(evidence: Evidence, name: str) -> Explanation | None:
    """Explain why the formulating rule of a goal class has not fired; None without such a rule."""
    try:
        book, texts = evidence.rulebook(), evidence.rule_texts()
    except CxbridgeError:
        return None
    top = f"no goal {name} has been formulated"
    lost = [*refused(book).values(), *unloaded(book)]
    maker_rules = makers({rule.name: rule.text for rule in lost}, name)
    if maker_rules:
        rule = next(rule for rule in lost if rule.name == maker_rules[0])
        headline, lines = f"{top}: rule {rule.name}, which makes it, {rule.why}", []
    else:
        maker_rules = makers(texts, name)
        if not maker_rules:
            return None
        story = rule_report.explain_rule(evidence, maker_rules[0])
        headline = f"{top}: {rule_report.headline(story)}"
        lines = list(rule_report.lines(story))[1:]
    return Explanation(
        (headline, *lines),
        {"headline": headline, "where": evidence.where, "goals": [], "notes": evidence.notes},
    )


def _neither(name: str, no_rule: CxbridgeError, no_goal: CxbridgeError) -> CxbridgeError:
    if not no_goal.message.startswith(_NO_GOAL):
        return no_goal
    hints = [error.hint for error in (no_rule, no_goal) if error.hint]
    return CxbridgeError(f"there is neither a rule nor a goal '{name}'", hint=hints[0] if hints else None)
