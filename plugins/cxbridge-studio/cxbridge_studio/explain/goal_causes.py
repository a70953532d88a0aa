"""Root causes of goals that wait or have failed: planners, lost rules, unmet needs of actions."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Final

from cxbridge.clipstext.condition import patterns
from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.history.model import GoalRecord, PlanActionRecord
from cxbridge.suggestions import nearest, or_similar
from cxbridge_studio.agent.rule import parse_rule
from cxbridge_studio.explain.action_diagnosis import ActionLook, look_at_action
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_rules import lost_rule_for, misspelt_for
from cxbridge_studio.explain.goals import Goals
from cxbridge_studio.explain.rules.lost import LostRule, refused, unloaded
from cxbridge_studio.explain.rules.snapshot import Rulebook

_FAILED_STATES: Final = ("EXECUTION-FAILED", "FAILED")
_NO_PLAN: Final = ("none", "failed", "cancelled", "timeout")
_SELECTS: Final = re.compile(r"\(state\s+PENDING\s*\)")
_EXECUTES: Final = re.compile(r"\(state\s+(?:WAITING|RUNNING|EXECUTION-SUCCEEDED)\s*\)")
_ASSERTS: Final = re.compile(r"\(assert\s")
_MAPPING: Final = "skill-action-mapping"
_ACTION: Final = "plan-action"
_LOCKS: Final = re.compile(r"\(acquired-resources\s")


class RootCauses:
    """Finder of root causes.

    :param facts: slots of facts by deftemplate.
    """

    def __init__(
        self, evidence: Evidence, goals: Goals, facts: Mapping[str, list[Mapping[str, str]]]
    ) -> None:
        self._evidence = evidence
        self._goals = goals
        self._facts = facts
        self._classes = frozenset(goal.goal_class for goal in goals.all)
        self._read: tuple[Rulebook, Mapping[str, str]] | None = None
        self._unloaded: list[LostRule] | None = None

    # --- goals --------------------------------------------------------------------------------------------

    def of_waiting(self, goal: GoalRecord) -> Iterator[str]:
        """Yield the reasons why a goal stays in its mode, the most certain first."""
        if goal.mode == "SELECTED":
            yield from self.of_planner(goal)
        book, texts = self._rules()
        slots = {"class": goal.goal_class, "mode": goal.mode}
        lost = lost_rule_for(refused(book).values(), slots)
        if lost is not None:
            yield f"rule {lost.name} {lost.why}"
        misspelt = misspelt_for(texts, slots, self._classes)
        if misspelt is not None:
            yield (
                f"rule {misspelt[0]} is for goals of class {misspelt[1]}, and there has been none: "
                f"did you mean {goal.goal_class}?"
            )
        if goal.mode == "COMMITTED":
            yield from self._resources(goal)
        lost = lost_rule_for(self._not_loaded(book), slots)
        if lost is not None:
            yield f"rule {lost.name} {lost.why}"

    def of_planner(self, goal: GoalRecord) -> Iterator[str]:
        """Yield the reason why the planner found no plan for a goal."""
        for last in list(self._goals.planner_calls(goal))[-1:]:
            if last.status not in _NO_PLAN:
                continue
            reason = " ".join(last.reason.split())
            yield f"the planner has no plan for {last.problem}: {reason or last.status}"

    def _resources(self, goal: GoalRecord) -> Iterator[str]:
        """Yield the resources that a goal still needs, with their holders."""
        facts = {slots.get("id", ""): slots for slots in self._facts_of("goal")}
        goal_facts = facts.get(goal.id, {})
        needed, acquired = (
            goal_facts.get(slot, "").split() for slot in ("required-resources", "acquired-resources")
        )
        for resource in sorted(set(needed) - set(acquired)):
            holders = [
                other
                for other, slots in facts.items()
                if other != goal.id and resource in slots.get("acquired-resources", "").split()
            ]
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
        _, texts = self._rules()
        if not texts or any(_LOCKS.search(text.partition("=>")[2]) for text in texts.values()):
            return ", whose holder is unknown"
        return ": no rule acquires resources: add resource-locks.clp to the files of the spec"

    # --- actions ------------------------------------------------------------------------------------------

    def of_action(self, goal: GoalRecord, action: PlanActionRecord) -> str:
        """Return why an action is not executed or has failed; empty if unknown."""
        key = goal.id, action.plan, action.id
        failed = action.state in _FAILED_STATES
        look = self._goals.look(action) if failed else look_at_action(self._facts_of, key)
        if look is None:
            return ""
        states = [change.state for change in action.changes if change.state not in _FAILED_STATES]
        state = states[-1] if states else ""
        _, texts = self._rules()
        return look.wrong + _of_rules(texts, look, state) or look.held_up or look.error

    def _facts_of(self, template: str) -> list[Mapping[str, str]]:
        return self._facts.get(template, [])

    def _rules(self) -> tuple[Rulebook, Mapping[str, str]]:
        """Return the rules; empty if the source knows none."""
        if self._read is None:
            try:
                self._read = self._evidence.rulebook(), self._evidence.rule_texts()
            except CxbridgeError:
                self._read = Rulebook(frozenset(), ()), {}
        return self._read

    def _not_loaded(self, book: Rulebook) -> list[LostRule]:
        if self._unloaded is None:
            self._unloaded = list(unloaded(book))
        return self._unloaded


def _rules_of_actions(texts: Mapping[str, str], state: str, sets: re.Pattern[str]) -> dict[str, list[str]]:
    """Return the rules that move actions out of a state, with the actions they name.

    :param sets: matches the change of state in the right-hand side.
    """
    rules_of_actions: dict[str, list[str]] = {}
    for name, text in texts.items():
        condition, _, actions = text.partition("=>")
        if _ACTION not in condition or state not in condition or not sets.search(actions):
            continue
        try:
            inner = list(patterns(parse_rule(text).ces))
        except ClipsError:
            continue
        for pattern in inner:
            if pattern.template == _ACTION and state in pattern.slots.get("state", ()):
                rules_of_actions[name] = sorted(pattern.slots.get("action-name", ()))
    return rules_of_actions


def _of_rules(texts: Mapping[str, str], look: ActionLook, state: str) -> str:
    """Return which rule an action in its state lacks; empty if unknown.

    The text follows the reason in ``look.wrong``, if there is one.
    """
    if not texts:
        return ""
    match state:
        case "FORMULATED" if not look.wrong:
            return _selection(texts, look)
        case "PENDING" if not look.wrong:
            return _execution(texts, look)
        case "SENSED-EFFECTS-WAIT" if look.wrong:
            like = _for_similar(_rules_of_actions(texts, state, _ASSERTS), look)
            return f": rule {like[0]} is for '{like[1]}', not '{look.name}'" if like else ""
    return ""


def _for_similar(rules: Mapping[str, list[str]], look: ActionLook) -> tuple[str, str] | None:
    """Return a rule for an action of a similar name, and that name; None if there is none."""
    for rule, names in rules.items():
        like = nearest(look.name, [name for name in names if name not in look.operators])
        if look.name not in names and like:
            return rule, like[0]
    return None


def _selection(texts: Mapping[str, str], look: ActionLook) -> str:
    """Return the missing action selection for the plan's type; empty if a rule selects the action."""
    rules = _rules_of_actions(texts, "FORMULATED", _SELECTS)
    kind = look.plan_type.lower() or "sequential"
    hint = f"add action-selection/{kind}.clp to the files of the spec"
    if not rules:
        return f"no action selection is loaded: {hint}"
    if look.plan_type and not any(
        not (types := _plan_types(texts[name])) or look.plan_type in types for name in rules
    ):
        return f"no action selection is loaded for plans of type {look.plan_type}: {hint}"
    return ""


def _plan_types(text: str) -> list[str]:
    """Return the plan types that a rule names; empty if the rule applies to all types."""
    plans = (pattern for pattern in patterns(parse_rule(text).ces) if pattern.template == "plan")
    return [kind for pattern in plans for kind in sorted(pattern.slots.get("type", ()))]


def _execution(texts: Mapping[str, str], look: ActionLook) -> str:
    """Return the missing executor of an action; empty if the action has an executor."""
    rules = _rules_of_actions(texts, "PENDING", _EXECUTES)
    with_skills = [name for name in rules if _MAPPING in texts[name]]
    if look.name in look.mappings and with_skills:
        return ""
    if any(look.name in names or (not names and rule not in with_skills) for rule, names in rules.items()):
        return ""
    like = _for_similar(rules, look)
    if like:
        return f"no rule executes it: rule {like[0]} executes '{like[1]}', not '{look.name}'"
    if not with_skills:
        return "no rule executes it: skills-actions.clp, which executes actions with skills, is not loaded"
    return (
        f"no skill is mapped to it{or_similar(look.name, look.mappings)}: "
        f"action-mapping in the spec lacks {look.name}, and no rule executes it"
    )
