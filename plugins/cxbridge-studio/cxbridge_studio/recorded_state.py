"""The state of a recorded run after some of its events: facts, goals, plan-actions, skills, interfaces."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field

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


@dataclass
class EnvironmentFacts:
    """The facts of each CLIPS environment."""

    by_env: dict[str, dict[int, FactChange]] = field(default_factory=dict)
    """The present facts in the order of assertion, by environment, then by index."""
    templates: dict[str, set[str]] = field(default_factory=dict)
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
        return EnvironmentFacts(
            {env: dict(facts) for env, facts in self.by_env.items()},
            {env: set(names) for env, names in self.templates.items()},
        )

    def read_slots(self, env: str, template: str) -> list[Mapping[str, str]]:
        """Return the slots of a deftemplate's facts, as CLIPS prints their values."""
        slots_of_facts: list[Mapping[str, str]] = []
        for change in self.by_env.get(env, {}).values():
            if change.template == template:
                with suppress(FactSyntaxError):  # a recording may contain any text as a fact
                    _, slots = parse_fact(change.text)
                    slots_of_facts.append(slots)
        return slots_of_facts


@dataclass
class RunState:
    """The goals, plan-actions, skills, interfaces and facts after the processed events."""

    goals: dict[tuple[str, str], GoalTransition] = field(default_factory=dict)
    """The last transition of each goal by environment and id, also of retracted goals; see `has_goal`."""
    actions: dict[tuple[str, str, str, str], PlanActionTransition] = field(default_factory=dict)
    """The last transition of each plan-action by environment, goal, plan and id."""
    skills: dict[tuple[str, str], SkillStatus] = field(default_factory=dict)
    """The last status of each Skiller by environment and id."""
    interfaces: dict[str, InterfaceWrite] = field(default_factory=dict)
    """The last write of each interface by ``Type::id``."""
    facts: EnvironmentFacts = field(default_factory=EnvironmentFacts)
    last_firing: RuleFired | None = None
    """The last firing of a rule; None before the first recorded firing."""
    _goal_facts: dict[tuple[str, str], int] = field(default_factory=dict)
    """The number of each goal's facts, by environment and goal id."""

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
                self.last_firing = event

    def copy(self) -> RunState:
        """Return an independent copy."""
        return RunState(
            dict(self.goals),
            dict(self.actions),
            dict(self.skills),
            dict(self.interfaces),
            self.facts.copy(),
            self.last_firing,
            dict(self._goal_facts),
        )

    def has_goal(self, env: str, goal: str) -> bool:
        """Return whether a goal exists.

        Without recorded facts of goals, a retracted goal counts as existing.
        """
        # The number of the goal's facts decides, because a modification retracts a fact and asserts another.
        if "goal" in self.facts.templates.get(env, ()):
            return self._goal_facts.get((env, goal), 0) > 0
        return (env, goal) in self.goals

    def _change_fact(self, event: FactChange) -> None:
        self.facts.add_change(event)
        if event.template == "goal":
            with suppress(FactSyntaxError, KeyError):  # a recording may contain any text
                _, slots = parse_fact(event.text)
                key = event.env, slots["id"]
                self._goal_facts[key] = self._goal_facts.get(key, 0) + (1 if event.asserted else -1)
