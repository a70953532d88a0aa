"""Explains a subject of a run: a rule, a goal, a plan-action or a fact by its name, or the whole run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge_studio.explain import facts, goal_report, run_story
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_rules import find_formulating_rules
from cxbridge_studio.explain.goals import UnknownGoalError
from cxbridge_studio.explain.rules import report as rule_report
from cxbridge_studio.explain.rules.missing import find_refused_rules, find_unloaded_rules

# The kinds of subjects of an explanation. The kind `run` needs no name.
KINDS: Final = ("rule", "goal", "action", "fact", "run")


@dataclass(frozen=True, slots=True)
class Explanation:
    """A report about one subject.

    :param lines: the report as text.
    :param data: the report as JSON values.
    """

    lines: tuple[str, ...]
    data: dict[str, Any]


def explain(evidence: Evidence, name: str, kind: str = "", rule_count: int = 1) -> Explanation:
    """Explain a subject of a run.

    :param kind: one of :data:`KINDS`, or empty to try in order: an existing rule, a goal, a missing rule.
    :param rule_count: the number of rules to list before each step of a goal.
    :raises CxbridgeError: if the name is unknown, or its state cannot be explained.
    """
    match kind:
        case "goal":
            return _explain_goal(evidence, name, rule_count)
        case "rule":
            return _explain_rule(evidence, name)
        case "action":
            return _explain_action(evidence, name)
        case "fact":
            fact_story = facts.explain_fact(evidence, name)
            return Explanation(tuple(facts.format_report(fact_story)), facts.to_json(fact_story))
        case "run":
            story = run_story.tell_run(evidence)
            return Explanation(tuple(run_story.format_report(story)), run_story.to_json(story))
        case _:
            return _explain_rule_or_goal(evidence, name, rule_count)


def _explain_rule_or_goal(evidence: Evidence, name: str, rule_count: int) -> Explanation:
    """Explain an existing rule, or else a goal, or else why a rule is missing."""
    try:
        is_rule = name in evidence.read_rulebook().rules
    except CxbridgeError as rules_error:
        return _explain_goal_without_rules(evidence, name, rule_count, rules_error)
    if is_rule:
        return _explain_rule(evidence, name)
    try:
        return _explain_goal(evidence, name, rule_count)
    except CxbridgeError as error:
        goal_error = error  # Python unbinds `error` at the end of the clause
    try:
        return _explain_rule(evidence, name)
    except CxbridgeError as rule_error:
        # Another error about the goal, such as that of an ambiguous name, tells the user more.
        if not isinstance(goal_error, UnknownGoalError):
            raise goal_error from None
        hint = rule_error.hint or goal_error.hint
        raise CxbridgeError(f"there is neither a rule nor a goal '{name}'", hint=hint) from None


def _explain_goal_without_rules(
    evidence: Evidence, name: str, rule_count: int, rules_error: CxbridgeError
) -> Explanation:
    """Explain a goal of an environment whose rules are unknown.

    :param rules_error: the error that says why the rules are unknown.
    """
    try:
        return _explain_goal(evidence, name, rule_count)
    except UnknownGoalError as goal_error:
        message = f"{goal_error.message}; its rules are unknown: {rules_error.message}"
        raise type(rules_error)(message, file=rules_error.file, hint=rules_error.hint) from None


def _explain_rule(evidence: Evidence, name: str) -> Explanation:
    story = rule_report.explain_rule(evidence, name)
    return Explanation(tuple(rule_report.format_report(story)), rule_report.to_json(story))


def _explain_goal(evidence: Evidence, name: str, rule_count: int) -> Explanation:
    try:
        stories = goal_report.explain_goals(evidence, name)
    except UnknownGoalError:
        explanation = _explain_unformulated_goal(evidence, name)
        if explanation is None:
            raise
        return explanation
    return Explanation(
        tuple(goal_report.format_goals(stories, evidence, rule_count)),
        goal_report.goals_to_json(stories, evidence),
    )


def _explain_action(evidence: Evidence, name: str) -> Explanation:
    stories = goal_report.explain_actions(evidence, name)
    return Explanation(
        tuple(goal_report.format_actions(stories, evidence)), goal_report.actions_to_json(stories, evidence)
    )


def _explain_unformulated_goal(evidence: Evidence, name: str) -> Explanation | None:
    """Explain why the rule that formulates goals of a class has not fired.

    :returns: None if no rule formulates such goals, or the rules are unknown.
    """
    try:
        rulebook, texts = evidence.read_rulebook(), evidence.read_rule_texts()
    except CxbridgeError:
        return None
    headline = f"no goal {name} has been formulated: "
    missing_rules = {
        rule.name: rule for rule in (*find_refused_rules(rulebook).values(), *find_unloaded_rules(rulebook))
    }
    lines: list[str] = []
    if missing_rule_names := find_formulating_rules(
        {rule.name: rule.text for rule in missing_rules.values()}, name
    ):
        rule = missing_rules[missing_rule_names[0]]
        headline += f"rule {rule.name}, which makes it, {rule.reason}"
    elif loaded_rule_names := find_formulating_rules(texts, name):
        story = rule_report.explain_rule(evidence, loaded_rule_names[0])
        headline += rule_report.make_headline(story)
        lines = list(rule_report.format_report(story))[1:]  # the first line is the headline, which is above
    else:
        return None
    return Explanation(
        (headline, *lines),
        {"headline": headline, "where": evidence.where, "goals": [], "notes": evidence.notes},
    )
