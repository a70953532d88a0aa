"""Explains a subject of a run: a rule, a goal, a plan-action or a fact by its name, or the whole run."""

from __future__ import annotations

from typing import Final

from cxbridge.errors import CxbridgeError
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.explanation import Explanation
from cxbridge_studio.explain.facts import explain_fact
from cxbridge_studio.explain.goal_report import explain_actions, explain_goals
from cxbridge_studio.explain.goal_rules import find_formulating_rules
from cxbridge_studio.explain.goals import UnknownGoalError
from cxbridge_studio.explain.rules import report as rule_report
from cxbridge_studio.explain.rules.missing import find_refused_rules, find_unloaded_rules
from cxbridge_studio.explain.run_story import explain_run

# The kinds of subjects of an explanation. The kind `run` needs no name.
KINDS: Final = ("rule", "goal", "action", "fact", "run")


def explain(evidence: Evidence, name: str, kind: str = "", rule_count: int = 1) -> Explanation:
    """Explain a subject of a run. The text ends with the notes of the evidence.

    :param kind: one of :data:`KINDS`, or empty to try in order: an existing rule, a goal, a missing rule.
    :param rule_count: the number of rules to list before each step of a goal.
    :raises CxbridgeError: if the name is unknown, or its state cannot be explained.
    """
    match kind:
        case "goal":
            explanation = _explain_goal(evidence, name, rule_count)
        case "rule":
            explanation = _explain_rule(evidence, name)
        case "action":
            explanation = explain_actions(evidence, name)
        case "fact":
            explanation = explain_fact(evidence, name)
        case "run":
            explanation = explain_run(evidence)
        case _:
            explanation = _explain_rule_or_goal(evidence, name, rule_count)
    notes = (f"note: {note}" for note in explanation.json_report["notes"])
    return Explanation((*explanation.lines, *notes), explanation.json_report)


def _explain_rule_or_goal(evidence: Evidence, name: str, rule_count: int) -> Explanation:
    """Explain an existing rule, or else a goal, or else why a rule is missing."""
    rules: frozenset[str] = frozenset()
    rules_error: CxbridgeError | None = None
    try:
        rules = evidence.read_rulebook().rules
    except CxbridgeError as error:
        rules_error = error  # Python unbinds `error` at the end of the clause
    if name in rules:
        return _explain_rule(evidence, name)
    try:
        return _explain_goal(evidence, name, rule_count)
    except UnknownGoalError as error:
        goal_error = error
    if rules_error is not None:
        message = f"{goal_error.message}; the rules of the run are unknown: {rules_error.message}"
        raise type(rules_error)(message, file=rules_error.file, hint=rules_error.hint)
    try:
        return _explain_rule(evidence, name)
    except CxbridgeError as error:
        message = f"there is neither a rule nor a goal '{name}'"
        raise CxbridgeError(message, hint=error.hint or goal_error.hint) from None


def _explain_rule(evidence: Evidence, name: str) -> Explanation:
    story = rule_report.explain_rule(evidence, name)
    return Explanation(tuple(rule_report.format_report(story)), rule_report.to_json(story))


def _explain_goal(evidence: Evidence, name: str, rule_count: int) -> Explanation:
    """Explain the goals with a name, or why no goal of a class with this name has been formulated."""
    try:
        return explain_goals(evidence, name, rule_count)
    except UnknownGoalError:
        explanation = _explain_unformulated_goal(evidence, name)
        if explanation is None:
            raise
        return explanation


def _explain_unformulated_goal(evidence: Evidence, name: str) -> Explanation | None:
    """Explain why the first rule that formulates goals of a class is missing or has not fired.

    :returns: None if no rule formulates such goals, or the rules are unknown.
    """
    try:
        rulebook, texts = evidence.read_rulebook(), evidence.read_rule_texts()
    except CxbridgeError:
        return None
    missing_rules = {
        rule.name: rule for rule in (*find_refused_rules(rulebook).values(), *find_unloaded_rules(rulebook))
    }
    missing_texts = {rule.name: rule.text for rule in missing_rules.values()}
    if missing_names := find_formulating_rules(missing_texts, name):
        missing_rule = missing_rules[missing_names[0]]
        reason, details = f"rule {missing_rule.name}, which makes it, {missing_rule.reason}", []
    elif loaded_names := find_formulating_rules(texts, name):
        # The first line of the report is its headline.
        reason, *details = rule_report.format_report(rule_report.explain_rule(evidence, loaded_names[0]))
    else:
        return None
    headline = f"no goal {name} has been formulated: {reason}"
    return Explanation(
        (headline, *details),
        {"headline": headline, "where": evidence.where, "goals": [], "notes": evidence.notes},
    )
