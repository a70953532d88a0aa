"""Explains a subject of a run: a rule, a goal, a plan-action or a fact by its name, or the whole run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge_studio.explain import facts, goal_report, run_story
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_rules import makers
from cxbridge_studio.explain.rules import report as rule_report
from cxbridge_studio.explain.rules.missing import refused_rules, unloaded_rules

# The kinds of subjects of an explanation. The kind `run` needs no name.
KINDS: Final = ("rule", "goal", "action", "fact", "run")

# The start of the error of :meth:`Goals.find` about an unknown goal. Its other errors, such as
# that of an ambiguous name, go to the user as they are.
_NO_GOAL: Final = "there is no goal"


@dataclass(frozen=True, slots=True)
class Explanation:
    """A report about one subject.

    :param lines: the report as text.
    :param plain: the report as JSON values.
    """

    lines: tuple[str, ...]
    plain: dict[str, Any]


def explain(evidence: Evidence, name: str, kind: str = "", rules: int = 1) -> Explanation:
    """Explain a subject of a run.

    :param kind: one of :data:`KINDS`, or empty to try in order: an existing rule, a goal, a missing rule.
    :param rules: the number of rules to list before each step of a goal.
    :raises CxbridgeError: if the name is unknown, or its state cannot be explained.
    """
    match kind:
        case "goal":
            return _explain_goal(evidence, name, rules)
        case "rule":
            return _explain_rule(evidence, name)
        case "action":
            return _explain_action(evidence, name)
        case "fact":
            fact_story = facts.explain_fact(evidence, name)
            return Explanation(tuple(facts.lines(fact_story)), facts.plain(fact_story))
        case "run":
            story = run_story.tell_run(evidence)
            return Explanation(tuple(run_story.lines(story)), run_story.plain(story))
        case _:
            return _explain_rule_or_goal(evidence, name, rules)


def _explain_rule_or_goal(evidence: Evidence, name: str, rules: int) -> Explanation:
    """Explain an existing rule, or else a goal, or else why a rule is missing."""
    try:
        is_rule = name in evidence.rulebook().rules
    except CxbridgeError as no_rules:
        return _explain_goal_without_rules(evidence, name, rules, no_rules)
    if is_rule:
        return _explain_rule(evidence, name)
    try:
        return _explain_goal(evidence, name, rules)
    except CxbridgeError as error:
        no_goal = error
    try:
        return _explain_rule(evidence, name)
    except CxbridgeError as no_rule:
        if not no_goal.message.startswith(_NO_GOAL):
            raise no_goal from None
        hint = no_rule.hint or no_goal.hint
        raise CxbridgeError(f"there is neither a rule nor a goal '{name}'", hint=hint) from None


def _explain_goal_without_rules(
    evidence: Evidence, name: str, rules: int, no_rules: CxbridgeError
) -> Explanation:
    """Explain a goal of an environment whose rules are unknown.

    :param no_rules: the error that says why the rules are unknown.
    """
    try:
        return _explain_goal(evidence, name, rules)
    except CxbridgeError as no_goal:
        if not no_goal.message.startswith(_NO_GOAL):
            raise
        message = f"{no_goal.message}; its rules are not known: {no_rules.message}"
        raise type(no_rules)(message, file=no_rules.file, hint=no_rules.hint) from None


def _explain_rule(evidence: Evidence, name: str) -> Explanation:
    story = rule_report.explain_rule(evidence, name)
    return Explanation(tuple(rule_report.lines(story)), rule_report.plain(story))


def _explain_goal(evidence: Evidence, name: str, rules: int) -> Explanation:
    try:
        stories = goal_report.explain_goals(evidence, name)
    except CxbridgeError as no_goal:
        explanation = _explain_missing_goal(evidence, name) if no_goal.message.startswith(_NO_GOAL) else None
        if explanation is None:
            raise
        return explanation
    return Explanation(
        tuple(goal_report.lines(stories, evidence, rules)), goal_report.plain(stories, evidence)
    )


def _explain_action(evidence: Evidence, name: str) -> Explanation:
    stories = goal_report.explain_actions(evidence, name)
    return Explanation(
        tuple(goal_report.action_lines(stories, evidence)), goal_report.plain_actions(stories, evidence)
    )


def _explain_missing_goal(evidence: Evidence, name: str) -> Explanation | None:
    """Explain why the rule that formulates goals of a class has not fired; None without such a rule."""
    try:
        book, texts = evidence.rulebook(), evidence.rule_texts()
    except CxbridgeError:
        return None
    headline = f"no goal {name} has been formulated: "
    missing = {rule.name: rule for rule in (*refused_rules(book).values(), *unloaded_rules(book))}
    lines: list[str] = []
    if missing_makers := makers({rule.name: rule.text for rule in missing.values()}, name):
        rule = missing[missing_makers[0]]
        headline += f"rule {rule.name}, which makes it, {rule.why}"
    elif loaded_makers := makers(texts, name):
        story = rule_report.explain_rule(evidence, loaded_makers[0])
        headline += rule_report.headline(story)
        lines = list(rule_report.lines(story))[1:]  # without the headline of the rule, which is in ours
    else:
        return None
    return Explanation(
        (headline, *lines),
        {"headline": headline, "where": evidence.where, "goals": [], "notes": evidence.notes},
    )
