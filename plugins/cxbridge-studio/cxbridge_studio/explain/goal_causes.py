"""Finds the root causes of goals that wait or have failed: planners, missing rules, preconditions of actions.

A root cause is the place to change. The rules' texts tell which rule would have moved a goal or an action to
its next state, and whether that rule is absent, refused or misspelt.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cached_property
from typing import Final

from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.history.model import GoalRecord, PlanActionRecord
from cxbridge.suggestions import nearest, or_similar
from cxbridge_studio.agent.condition import patterns
from cxbridge_studio.agent.rule import parse_rule
from cxbridge_studio.explain.action_diagnosis import FAILED_STATES, ActionDiagnosis, diagnose_action
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_rules import missing_rule_for, misspelt_rule_for
from cxbridge_studio.explain.goals import Goals
from cxbridge_studio.explain.rules.missing import MissingRule, refused_rules, unloaded_rules
from cxbridge_studio.explain.rules.snapshot import Rulebook

_NO_PLAN: Final = ("none", "failed", "cancelled", "timeout")

# Texts in the right-hand sides of rules, the core's and those that execute actions. Each text tells which
# step of an action's life the rule makes.
_SELECTS: Final = re.compile(r"\(state\s+PENDING\s*\)")
_EXECUTES: Final = re.compile(r"\(state\s+(?:WAITING|RUNNING|EXECUTION-SUCCEEDED)\s*\)")
_ASSERTS: Final = re.compile(r"\(assert\s")
_MAPPING: Final = "skill-action-mapping"
_ACTION: Final = "plan-action"
_ACQUIRES: Final = re.compile(r"\(acquired-resources\s")


class RootCauses:
    """Finder of root causes.

    :param facts: the slots of the facts, by deftemplate.
    """

    def __init__(
        self, evidence: Evidence, goals: Goals, facts: Mapping[str, list[Mapping[str, str]]]
    ) -> None:
        self._evidence = evidence
        self._goals = goals
        self._facts = facts
        self._classes = frozenset(goal.goal_class for goal in goals.all)

    @cached_property
    def _rules(self) -> tuple[Rulebook, Mapping[str, str]]:
        """The rules and their texts; empty if the source knows none."""
        try:
            return self._evidence.rulebook(), self._evidence.rule_texts()
        except CxbridgeError:
            return Rulebook(frozenset(), ()), {}

    @cached_property
    def _unloaded(self) -> list[MissingRule]:
        return list(unloaded_rules(self._rules[0]))

    # --- goals

    def of_waiting(self, goal: GoalRecord) -> Iterator[str]:
        """Yield the reasons why a goal stays in its mode, the most certain first."""
        if goal.mode == "SELECTED":
            yield from self.of_planner(goal)
        book, texts = self._rules
        slots = {"class": goal.goal_class, "mode": goal.mode}
        if (rule := missing_rule_for(refused_rules(book).values(), slots)) is not None:
            yield f"rule {rule.name} {rule.why}"
        misspelt = misspelt_rule_for(texts, slots, self._classes)
        if misspelt is not None:
            rule_name, misspelt_class = misspelt
            yield (
                f"rule {rule_name} is for goals of class {misspelt_class}, and there has been none: "
                f"did you mean {goal.goal_class}?"
            )
        if goal.mode == "COMMITTED":
            yield from self._resources(goal)
        # The least certain: many agents keep rules in files that this spec does not load on purpose.
        if (rule := missing_rule_for(self._unloaded, slots)) is not None:
            yield f"rule {rule.name} {rule.why}"

    def of_planner(self, goal: GoalRecord) -> Iterator[str]:
        """Yield the reason why the last planner call found no plan for a goal."""
        calls = list(self._goals.planner_calls(goal))
        if calls and calls[-1].status in _NO_PLAN:
            # The output of a planner may have several lines.
            reason = " ".join(calls[-1].reason.split()) or calls[-1].status
            yield f"the planner has no plan for {calls[-1].problem}: {reason}"

    def _resources(self, goal: GoalRecord) -> Iterator[str]:
        """Yield the resources that a goal still needs, with their holders."""
        facts = {slots.get("id", ""): slots for slots in self._facts_of("goal")}
        goal_facts = facts.get(goal.id, {})
        needed, acquired = (
            goal_facts.get(slot, "").split() for slot in ("required-resources", "acquired-resources")
        )
        for resource in sorted(set(needed) - set(acquired)):
            holders = [
                goal_id
                for goal_id, slots in facts.items()
                if goal_id != goal.id and resource in slots.get("acquired-resources", "").split()
            ]
            # The core locks the mutex `resource-NAME` of a resource, also for agents on other robots.
            locks = [
                slots.get("locked-by", "")
                for slots in self._facts_of("mutex")
                if slots.get("name") == f"resource-{resource}" and slots.get("state") == "LOCKED"
            ]
            if holders:
                yield f"resource {resource}: goal {', '.join(holders)} has it"
            elif locks and locks[0]:
                yield f"resource {resource}: {locks[0]} has locked it"
            else:
                yield f"resource {resource}{self._no_holder()}"

    def _no_holder(self) -> str:
        """Return why no goal holds a resource."""
        _, texts = self._rules
        if not texts or any(_ACQUIRES.search(text.partition("=>")[2]) for text in texts.values()):
            return ", whose holder is unknown"
        return ": no rule acquires resources: add resource-locks.clp to the files of the spec"

    # --- actions

    def of_action(self, goal: GoalRecord, action: PlanActionRecord) -> str:
        """Return why an action is not executed or has failed; empty if unknown."""
        key = goal.id, action.plan, action.id
        # The facts of a failed action may have changed since: its diagnosis was made when it failed.
        if action.state in FAILED_STATES:
            diagnosis = self._goals.diagnosis(action)
        else:
            diagnosis = diagnose_action(self._facts_of, key)
        if diagnosis is None:
            return ""
        states = [change.state for change in action.changes if change.state not in FAILED_STATES]
        missing_rule = _text_of_missing_rule(self._rules[1], diagnosis, states[-1] if states else "")
        return diagnosis.problem + missing_rule or diagnosis.skiller_problem or diagnosis.error

    def _facts_of(self, template: str) -> list[Mapping[str, str]]:
        return self._facts.get(template, [])


def _rules_of_actions(texts: Mapping[str, str], state: str, change: re.Pattern[str]) -> dict[str, list[str]]:
    """Return the rules that move actions out of a state, each with the actions that it names.

    :param change: matches the change of state in the right-hand side.
    """
    rules_of_actions: dict[str, list[str]] = {}
    for name, text in texts.items():
        condition, _, actions = text.partition("=>")
        # Parsing is slow, and an agent has hundreds of rules: the search for words comes first.
        if _ACTION not in condition or state not in condition or not change.search(actions):
            continue
        with suppress(ClipsError):
            for pattern in patterns(parse_rule(text).ces):
                if pattern.template == _ACTION and state in pattern.slots.get("state", ()):
                    rules_of_actions[name] = sorted(pattern.slots.get("action-name", ()))
    return rules_of_actions


def _text_of_missing_rule(texts: Mapping[str, str], diagnosis: ActionDiagnosis, state: str) -> str:
    """Return which rule an action in its state lacks; empty if unknown.

    The text follows the reason in ``diagnosis.problem``, if there is one.
    """
    if not texts:
        return ""
    match state:
        case "FORMULATED" if not diagnosis.problem:
            return _missing_selection(texts, diagnosis)
        case "PENDING" if not diagnosis.problem:
            return _missing_execution(texts, diagnosis)
        case "SENSED-EFFECTS-WAIT" if diagnosis.problem:
            similar = _rule_for_similar(_rules_of_actions(texts, state, _ASSERTS), diagnosis)
            if similar is not None:
                rule, similar_name = similar
                return f": rule {rule} is for '{similar_name}', not '{diagnosis.name}'"
    return ""


def _rule_for_similar(rules: Mapping[str, list[str]], diagnosis: ActionDiagnosis) -> tuple[str, str] | None:
    """Return a rule for an action of a similar name, and that name; None if there is none."""
    for rule, names in rules.items():
        similar = nearest(diagnosis.name, [name for name in names if name not in diagnosis.operators])
        if diagnosis.name not in names and similar:
            return rule, similar[0]
    return None


def _missing_selection(texts: Mapping[str, str], diagnosis: ActionDiagnosis) -> str:
    """Return the missing action selection for the plan's type; empty if a rule selects the action."""
    rules = _rules_of_actions(texts, "FORMULATED", _SELECTS)
    plan_type = diagnosis.plan_type
    hint = f"add action-selection/{plan_type.lower() or 'sequential'}.clp to the files of the spec"
    if not rules:
        return f"no action selection is loaded: {hint}"
    types_of_rules = [_plan_types(texts[name]) for name in rules]
    if plan_type and not any(not types or plan_type in types for types in types_of_rules):
        return f"no action selection is loaded for plans of type {plan_type}: {hint}"
    return ""


def _plan_types(text: str) -> list[str]:
    """Return the plan types that a rule names; empty if the rule applies to all types."""
    plans = (pattern for pattern in patterns(parse_rule(text).ces) if pattern.template == "plan")
    return [kind for pattern in plans for kind in sorted(pattern.slots.get("type", ()))]


def _missing_execution(texts: Mapping[str, str], diagnosis: ActionDiagnosis) -> str:
    """Return the missing executor of an action; empty if the action has an executor."""
    name = diagnosis.name
    rules = _rules_of_actions(texts, "PENDING", _EXECUTES)
    # The core's rule for skills names no action either, but executes only those of the action mapping.
    with_skills = [rule for rule in rules if _MAPPING in texts[rule]]
    if name in diagnosis.mappings and with_skills:
        return ""
    if any(name in names or (not names and rule not in with_skills) for rule, names in rules.items()):
        return ""
    similar = _rule_for_similar(rules, diagnosis)
    if similar is not None:
        rule, similar_name = similar
        return f"no rule executes it: rule {rule} executes '{similar_name}', not '{name}'"
    if not with_skills:
        return "no rule executes it: skills-actions.clp, which executes actions with skills, is not loaded"
    return (
        f"no skill is mapped to it{or_similar(name, diagnosis.mappings)}: "
        f"action-mapping in the spec lacks {name}, and no rule executes it"
    )
