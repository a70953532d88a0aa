"""Finds the root causes of goals that wait or have failed: planners, missing rules, preconditions of actions.

A root cause is the place to change. The texts of the rules tell which rule would have moved a goal or an
action to its next state, and whether that rule is absent, refused by CLIPS or misspelt.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cached_property
from itertools import islice
from typing import Final

from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.history.model import PLAN_ACTION, GoalRecord, PlanActionRecord
from cxbridge.suggestions import bracketed_suggestion, nearest_names
from cxbridge_studio.agent.condition import find_patterns
from cxbridge_studio.agent.rule import parse_rule
from cxbridge_studio.explain.action_diagnosis import FAILED_STATES, ActionDiagnosis, diagnose_action
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_rules import find_missing_rule, find_misspelt_rules
from cxbridge_studio.explain.goals import Goals
from cxbridge_studio.explain.rules.missing import MissingRule, find_refused_rules, find_unloaded_rules
from cxbridge_studio.explain.rules.snapshot import Rulebook

# The statuses of a planner call that ended without a plan.
_STATUSES_WITHOUT_PLAN: Final = ("none", "failed", "cancelled", "timeout")

# Patterns for right-hand sides of rules: each shows which step in the life of an action the rule performs.
_SELECTION: Final = re.compile(r"\(state\s+PENDING\s*\)")
_EXECUTION: Final = re.compile(r"\(state\s+(?:WAITING|RUNNING|EXECUTION-SUCCEEDED)\s*\)")
_ASSERTION: Final = re.compile(r"\(assert\s")

_ACQUISITION: Final = re.compile(r"\(acquired-resources\s")  # a right-hand side that acquires resources

# an atom in the text of a diagnosis: `(NAME VALUES) is false`
_FALSE_ATOM: Final = re.compile(r"\((?P<name>[^\s()]+)(?P<values>(?:\s[^()]*)?)\) is false")


class RootCauseFinder:
    """Finds the root causes of goals and actions, as texts without a final full stop.

    :param facts: the slots of the facts, by deftemplate.
    """

    def __init__(
        self, evidence: Evidence, goals: Goals, facts: Mapping[str, list[Mapping[str, str]]]
    ) -> None:
        self._evidence = evidence
        self._goals = goals
        self._find_facts = facts.__getitem__
        self._classes = frozenset(goal.goal_class for goal in goals.records)

    @cached_property
    def _rules_and_texts(self) -> tuple[Rulebook, Mapping[str, str]]:
        """The rules and their texts; empty if the source knows none."""
        try:
            return self._evidence.read_rulebook(), self._evidence.read_rule_texts()
        except CxbridgeError:
            return Rulebook(frozenset(), ()), {}

    @cached_property
    def _unloaded_rules(self) -> list[MissingRule]:
        return list(find_unloaded_rules(self._rules_and_texts[0]))

    # --- goals

    def find_wait_causes(self, goal: GoalRecord) -> Iterator[str]:
        """Yield the reasons why a goal stays in its mode, the most certain first."""
        if goal.mode == "SELECTED":
            yield from self.find_planner_cause(goal)
        rulebook, texts = self._rules_and_texts
        slots = {"class": goal.goal_class, "mode": goal.mode}
        if (rule := find_missing_rule(find_refused_rules(rulebook).values(), slots)) is not None:
            yield f"rule {rule.name} {rule.reason}"
        # The first misspelt rule is enough: the others are often of the same file.
        for rule_name, misspelt_class in islice(find_misspelt_rules(texts, slots, self._classes), 1):
            yield (
                f"rule {rule_name} is for goals of class {misspelt_class}, but there has been no such goal: "
                f"did you mean {goal.goal_class}?"
            )
        if goal.mode == "COMMITTED":
            yield from self._describe_missing_resources(goal)
        # The least certain reason: many agents keep rules in files that this spec omits on purpose.
        if (rule := find_missing_rule(self._unloaded_rules, slots)) is not None:
            yield f"rule {rule.name} {rule.reason}"

    def find_planner_cause(self, goal: GoalRecord) -> Iterator[str]:
        """Yield the reason why the last planner call found no plan for a goal, if it found none."""
        calls = list(self._goals.find_planner_calls(goal))
        if calls and calls[-1].status in _STATUSES_WITHOUT_PLAN:
            # The output of a planner may have several lines.
            reason = " ".join(calls[-1].reason.split()) or calls[-1].status
            yield f"the planner found no plan for {calls[-1].problem}: {reason}"

    def _describe_missing_resources(self, goal: GoalRecord) -> Iterator[str]:
        """Yield the resources that a goal still needs, with their holders."""
        slots_by_goal = {slots.get("id", ""): slots for slots in self._find_facts("goal")}
        goal_slots = slots_by_goal.get(goal.id, {})
        needed_names, acquired_names = (
            goal_slots.get(slot, "").split() for slot in ("required-resources", "acquired-resources")
        )
        for resource in sorted(set(needed_names) - set(acquired_names)):
            holders = [
                goal_id
                for goal_id, slots in slots_by_goal.items()
                if goal_id != goal.id and resource in slots.get("acquired-resources", "").split()
            ]
            holder_text = f" is held by goal {', '.join(holders)}" if holders else self._describe_no_holder()
            yield f"resource {resource}{holder_text}"

    def _describe_no_holder(self) -> str:
        """Return why no goal holds a resource, as the end of a sentence."""
        _, texts = self._rules_and_texts
        if not texts or any(_ACQUISITION.search(text.partition("=>")[2]) for text in texts.values()):
            return ", whose holder is unknown"
        return ": no rule acquires resources: add resource-locks.clp to the files of the spec"

    # --- actions

    def find_action_cause(self, goal: GoalRecord, action: PlanActionRecord) -> str:
        """Return why an action is not executed or has failed; empty if unknown."""
        # The facts of a failed action may have changed since: its diagnosis was made when it failed.
        diagnosis = (
            self._goals.find_failure_diagnosis(action)
            if action.state in FAILED_STATES
            else diagnose_action(self._find_facts, (goal.id, action.plan, action.id))
        )
        if diagnosis is None:
            return ""
        states = [change.state for change in action.changes if change.state not in FAILED_STATES]
        # The precondition of an action that was executed is no reason, since its effects change facts.
        if "EXECUTION-SUCCEEDED" in states and diagnosis.error:
            return diagnosis.error
        missing_rule = _describe_missing_rule(
            self._rules_and_texts[1], diagnosis, states[-1] if states else ""
        )
        problem = _FALSE_ATOM.sub(self._describe_end_of_atom, diagnosis.problem)
        return problem + missing_rule or diagnosis.skiller_problem or diagnosis.error

    def _describe_end_of_atom(self, match: re.Match[str]) -> str:
        """Return a false atom with the time at which it became false, and the action or rule that did this.

        Return only the atom if its retraction is unknown.

        :param match: a match of `_FALSE_ATOM`.
        """
        text = f"(domain-fact (name {match['name']}) (param-values{match['values']}))"
        lives = [*self._evidence.history.fact_lives.values()]
        life = next((life for life in reversed(lives) if life.text == text), None)
        if life is None or life.end_us is None:
            return match[0]
        makers = [
            f"by the effect of action {action.id} {action.name}{action.params} of {action.goal}"
            for goal in self._goals.records
            for action in goal.actions
            for change in action.changes
            if change.state == "EFFECTS-APPLIED"
            and self._goals.time_us(change.seq) == life.end_us
            # Several actions may end at this time: only an action with all objects of the atom counts.
            and {*match["values"].split()} <= {*action.params.strip("()").split()}
        ] or [f"by rule {life.end_rule}" if life.end_rule else "by no rule"]
        return f"{match[0]}, made false at {self._evidence.compute_seconds(life.end_us):.3f} s {makers[0]}"


def _find_action_rules(
    texts: Mapping[str, str], state: str, change_pattern: re.Pattern[str]
) -> dict[str, list[str]]:
    """Return the rules that move actions out of a state, each with the names of its actions.

    A rule without names applies to all actions.

    :param change_pattern: matches the change of state in the right-hand side.
    """
    action_names_by_rule: dict[str, list[str]] = {}
    for name, text in texts.items():
        condition, _, actions = text.partition("=>")
        # Parsing is slow, and an agent has hundreds of rules: the search for words comes first.
        if PLAN_ACTION not in condition or state not in condition or not change_pattern.search(actions):
            continue
        with suppress(ClipsError):
            for pattern in find_patterns(parse_rule(text).ces):
                if pattern.template == PLAN_ACTION and state in pattern.words_by_slot.get("state", ()):
                    action_names_by_rule[name] = sorted(pattern.words_by_slot.get("action-name", ()))
    return action_names_by_rule


def _describe_missing_rule(texts: Mapping[str, str], diagnosis: ActionDiagnosis, state: str) -> str:
    """Return which rule an action in its state lacks, as the continuation of the diagnosis' problem.

    The text is empty if no rule is missing, or the rules are unknown.
    """
    if not texts:
        return ""
    match state:
        case "FORMULATED" if not diagnosis.problem and not _find_action_rules(texts, state, _SELECTION):
            file = f"action-selection/{diagnosis.plan_type.lower() or 'sequential'}.clp"
            return f"no action selection is loaded: add {file} to the files of the spec"
        case "PENDING" if not diagnosis.problem:
            return _describe_missing_executor(texts, diagnosis)
        case "SENSED-EFFECTS-WAIT" if diagnosis.problem:
            rules = _find_action_rules(texts, state, _ASSERTION)
            return _describe_rule_for_similar_action(": rule {} is for '{}', not '{}'", rules, diagnosis)
    return ""


def _describe_rule_for_similar_action(
    template: str, rules: Mapping[str, list[str]], diagnosis: ActionDiagnosis
) -> str:
    """Return a text about a rule for an action of a similar name; empty if there is no such rule.

    A name that the domain defines is not a misspelling.

    :param template: the text, with places for the rule, the similar name and the action's name.
    """
    for rule, names in rules.items():
        similar_names = nearest_names(diagnosis.name, set(names).difference(diagnosis.operators))
        if diagnosis.name not in names and similar_names:
            return template.format(rule, similar_names[0], diagnosis.name)
    return ""


def _describe_missing_executor(texts: Mapping[str, str], diagnosis: ActionDiagnosis) -> str:
    """Return which executor an action lacks; empty if a rule or a skill executes the action."""
    name = diagnosis.name
    rules = _find_action_rules(texts, "PENDING", _EXECUTION)
    # The core's rule for skills names no action either, but executes only those of the action mapping.
    skill_rules = [rule for rule in rules if "skill-action-mapping" in texts[rule]]
    is_mapped = name in diagnosis.mappings and skill_rules
    if is_mapped or any(
        name in names or (not names and rule not in skill_rules) for rule, names in rules.items()
    ):
        return ""
    template = "no rule executes it: rule {} executes '{}', not '{}'"
    if similar_rule_text := _describe_rule_for_similar_action(template, rules, diagnosis):
        return similar_rule_text
    if not skill_rules:
        return "no rule executes it: skills-actions.clp, which executes actions with skills, is not loaded"
    return (
        f"no skill is mapped to it{bracketed_suggestion(name, diagnosis.mappings)}: "
        f"action-mapping in the spec lacks {name}, and no rule executes it"
    )
