"""The state of a recorded run after some of its events: facts, goals, plan-actions, skills, interfaces."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceWrite,
    PlanActionTransition,
    RuleFired,
    SkillStatus,
)


class EnvironmentFacts:
    """The facts of each CLIPS environment."""

    def __init__(self) -> None:
        self.by_env: dict[str, dict[int, FactChange]] = {}
        """The present facts in the order of assertion, by environment, then by index."""
        self.templates: dict[str, set[str]] = {}
        """The deftemplates of all facts so far, by environment."""

    def add_change(self, event: FactChange) -> None:
        """Process the next change of a fact."""
        facts = self.by_env.setdefault(event.env, {})
        # A retraction, too, shows that the recording has facts of this deftemplate.
        self.templates.setdefault(event.env, set()).add(event.template)
        if event.asserted:
            facts[event.index] = event
        else:
            facts.pop(event.index, None)

    def copy(self) -> EnvironmentFacts:
        """Return an independent copy."""
        duplicate = EnvironmentFacts()
        duplicate.by_env = {env: dict(facts) for env, facts in self.by_env.items()}
        duplicate.templates = {env: set(names) for env, names in self.templates.items()}
        return duplicate

    def read_slots(self, env: str, template: str) -> list[Mapping[str, str]]:
        """Return the slots of a deftemplate's facts, as CLIPS prints their values."""
        slots: list[Mapping[str, str]] = []
        for change in self.by_env.get(env, {}).values():
            if change.template == template:
                with suppress(FactSyntaxError):  # a recording may contain any text as a fact
                    slots.append(parse_fact(change.text)[1])
        return slots


class RunState:
    """The goals, plan-actions, skills, interfaces and facts after the processed events."""

    def __init__(self) -> None:
        self.goals: dict[tuple[str, str], GoalTransition] = {}
        """The last transition of each goal by environment and id, also of retracted goals; see `has_goal`."""
        self.actions: dict[tuple[str, str, str, str], PlanActionTransition] = {}
        """The last transition of each plan-action by environment, goal, plan and id."""
        self.skills: dict[tuple[str, str], SkillStatus] = {}
        """The last status of each Skiller by environment and id."""
        self.interfaces: dict[str, InterfaceWrite] = {}
        """The last write of each interface by ``Type::id``."""
        self.facts = EnvironmentFacts()
        self.rule: RuleFired | None = None
        """The rule that fired last."""
        self._goal_facts: dict[tuple[str, str], int] = {}

    def add_event(self, event: Event) -> None:
        """Process the next event."""
        match event:
            case FactChange():
                self._change_fact(event)
            case GoalTransition() if not event.is_unnamed:
                self.goals[event.env, event.goal] = event
            case PlanActionTransition():
                self.actions[event.env, event.goal, event.plan, event.action_id] = event
            case SkillStatus():
                self.skills[event.env, event.skiller] = event
            case InterfaceWrite():
                self.interfaces[event.uid] = event
            case RuleFired():
                self.rule = event

    def copy(self) -> RunState:
        """Return an independent copy."""
        duplicate = RunState()
        duplicate.goals.update(self.goals)
        duplicate.actions.update(self.actions)
        duplicate.skills.update(self.skills)
        duplicate.interfaces.update(self.interfaces)
        duplicate.facts = self.facts.copy()
        duplicate.rule = self.rule
        duplicate._goal_facts.update(self._goal_facts)
        return duplicate

    def has_goal(self, env: str, goal: str) -> bool:
        """Return whether a goal exists. Without recorded facts, a retracted goal counts as existing."""
        # The number of the goal's facts decides, because a modification retracts a fact and asserts another.
        if "goal" in self.facts.templates.get(env, ()):
            return self._goal_facts.get((env, goal), 0) > 0
        return (env, goal) in self.goals

    def _change_fact(self, event: FactChange) -> None:
        self.facts.add_change(event)
        if event.template == "goal":
            with suppress(FactSyntaxError, KeyError):  # a recording may contain any text
                key = event.env, parse_fact(event.text)[1]["id"]
                self._goal_facts[key] = self._goal_facts.get(key, 0) + (1 if event.asserted else -1)
