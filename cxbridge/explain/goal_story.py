"""How a goal came to its outcome, or what it waits for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from cxbridge.events import GoalTransition, PlanActionTransition
from cxbridge.explain.evidence import Evidence, Step
from cxbridge.explain.goal_rules import rules_for
from cxbridge.explain.goals import DONE, ENDED, Action, Goal, Goals, failed_actions
from cxbridge.goaltree import NO_PARENT

_SHOWN_STATES: Final = ("RUNNING", "EXECUTION-FAILED", "FAILED", "FINAL")
_DEEPEST: Final = 20

Facts = Mapping[str, list[Mapping[str, str]]]
"""The facts of some deftemplates: slots, as CLIPS prints their values."""

FACT_TEMPLATES: Final = ("goal", "plan-action", "mutex")
"""The facts that tell what a goal waits for."""


@dataclass(frozen=True, slots=True)
class Moment:
    """Something that happened to a goal.

    :param seconds: since the begin of the run.
    :param rules: the rules that fired just before, the last one last.
    """

    seconds: float
    text: str
    rules: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Cause:
    """Why something is as it is; ``because`` goes on where it came from."""

    text: str
    because: tuple[Cause, ...] = ()


@dataclass(frozen=True, slots=True)
class GoalStory:
    """What is told of a goal.

    :param number: among those of its class, from 1.
    :param cause: of its outcome, or what it waits for.
    :param waits: whether it has not ended.
    """

    goal: str
    goal_class: str
    sub_type: str
    parent: str
    mode: str
    outcome: str
    error: str
    number: int
    waits: bool
    cause: Cause
    moments: tuple[Moment, ...]


class Storyteller:
    """Tells of the goals of a run.

    :param evidence: with a history.
    """

    def __init__(self, evidence: Evidence, goals: Goals, facts: Facts) -> None:
        self._evidence = evidence
        self._goals = goals
        self._facts = facts
        assert evidence.history is not None
        self._rules_known = evidence.history.rules_known
        self._order = {id(step): number for number, step in enumerate(evidence.history.steps)}
        self._depth = 0

    def tell(self, goal: Goal) -> GoalStory:
        """Return the story of a goal."""
        event = goal.event
        waits = goal.ended is None
        parent = self._goals.parent(goal)
        return GoalStory(
            goal.goal,
            event.goal_class,
            "" if event.sub_type == "nil" else event.sub_type,
            "" if event.parent == NO_PARENT else parent.title if parent else event.parent,
            event.mode,
            event.outcome,
            event.error,
            self._goals.of_class(event.goal_class).index(goal) + 1,
            waits,
            Cause(self._waits_for(goal), tuple(self._holdups(goal, 0)))
            if waits
            else Cause(self._outcome(goal), (*self._because(goal, {goal.goal}), *self._left_over(goal))),
            tuple(self._moments(goal)),
        )

    # --- what happened ------------------------------------------------------------------------------------

    def _moments(self, goal: Goal) -> Iterator[Moment]:
        """Yield what happened to a goal, its actions and its sub-goals, in order."""
        found = [(step, self._goal_text(goal, place)) for place, step in enumerate(goal.steps)]
        for action in goal.actions:
            found += [(step, self._action_text(action, place)) for place, step in enumerate(action.steps)]
        for child in goal.children:
            found += [(step, self._child_text(child, place)) for place, step in enumerate(child.steps)]
        for step, text in sorted(found, key=lambda item: self._order[id(item[0])]):
            if text:
                yield Moment(self._evidence.seconds(step.event.time_us), text, step.rules)

    @staticmethod
    def _goal_text(goal: Goal, place: int) -> str:
        event = goal.steps[place].event
        assert isinstance(event, GoalTransition)
        if place:
            before = goal.steps[place - 1].event
            assert isinstance(before, GoalTransition)
            if before.mode == event.mode and before.parent != event.parent:
                return f"becomes a sub-goal of {event.parent}"
        outcome = "" if event.outcome == "UNKNOWN" or event.mode != "FINISHED" else f" {event.outcome}"
        error = f", error: {event.error}" if event.error and event.mode == "FINISHED" else ""
        return f"{event.mode}{outcome}{error}"

    def _action_text(self, action: Action, place: int) -> str:
        event = action.steps[place].event
        assert isinstance(event, PlanActionTransition)
        last = place == len(action.steps) - 1
        if event.state not in _SHOWN_STATES and not (last and event.state != "FORMULATED"):
            return ""
        skill = ""
        if action.skill is not None:
            if event.state == "RUNNING":
                skill = f", skill {action.skill.skill_string}"
            elif event.state in ("EXECUTION-FAILED", "FAILED") and action.skill.error:
                skill = f": {action.skill.error}"
        return f"  action {action.action_id} {action.name} {event.state}{skill}"

    @staticmethod
    def _child_text(child: Goal, place: int) -> str:
        event = child.steps[place].event
        assert isinstance(event, GoalTransition)
        before = child.steps[place - 1].event if place else None
        if isinstance(before, GoalTransition) and before.mode == event.mode:
            return ""
        if event.mode == "FINISHED":
            error = f", error: {event.error}" if event.error else ""
            return f"  sub-goal {child.title} {event.outcome}{error}"
        return f"  sub-goal {child.title} {event.mode}" if event.mode in ("SELECTED", "DISPATCHED") else ""

    # --- why it ended so ----------------------------------------------------------------------------------

    def _at(self, step: Step) -> str:
        return f"{self._evidence.seconds(step.event.time_us):.3f} s"

    def _outcome(self, goal: Goal) -> str:
        step = goal.ended
        assert step is not None
        event = step.event
        assert isinstance(event, GoalTransition)
        error = f", error: {event.error}" if event.error else ""
        return f"{goal.title} {event.outcome} at {self._at(step)}{error}{self._formerly(goal)}"

    def _formerly(self, goal: Goal) -> str:
        """Return the outcomes that a goal had before it was formulated again."""
        ends = [
            f"{step.event.outcome} at {self._at(step)}"
            for step in goal.former_ends
            if isinstance(step.event, GoalTransition)
        ]
        return f"; before, it was {', '.join(ends)}" if ends else ""

    def _because(self, goal: Goal, told: set[str]) -> Iterator[Cause]:
        """Yield what made a goal end as it did."""
        step = goal.ended
        if step is None or not isinstance(step.event, GoalTransition):
            return
        if step.event.outcome == "COMPLETED":
            yield from self._completed(goal, step)
            return
        named = [other for other in self._goals.named_in(step.event.error, goal) if other.goal not in told]
        found = [Cause(self._outcome(other), self._further(other, told)) for other in named if other.ended]
        if not found:
            found = [self._failed_action(action) for action in failed_actions(goal.actions)]
        if not found:
            found = [
                Cause(self._outcome(child), self._further(child, told))
                for child in goal.children
                if _ended_badly(child, step) and child.goal not in told
            ][-1:]
        yield from found
        yield self._decision(step, goal)

    def _further(self, goal: Goal, told: set[str]) -> tuple[Cause, ...]:
        if goal.goal in told or len(told) > _DEEPEST:
            return ()
        return tuple(self._because(goal, told | {goal.goal}))

    def _decision(self, step: Step, goal: Goal) -> Cause:
        """Return which rule ended a goal."""
        assert isinstance(step.event, GoalTransition)
        if step.rules:
            return Cause(f"rule {step.rules[-1]} set {goal.goal} to {step.event.outcome}")
        if self._rules_known:
            return Cause(f"no rule fired just before {goal.goal} ended")
        return Cause("which rule decided so is not known: firings were not recorded (level rules)")

    def _completed(self, goal: Goal, step: Step) -> Iterator[Cause]:
        done = [action for action in goal.actions if action.state == "FINAL"]
        if goal.actions:
            yield Cause(f"{len(done)} of {len(goal.actions)} actions are done")
        for child in goal.children:
            if child.ended is not None:
                yield Cause(self._outcome(child))
        yield self._decision(step, goal)

    def _failed_action(self, action: Action) -> Cause:
        failed = [step for step in action.steps if _state(step) == "EXECUTION-FAILED"]
        step = (failed or action.steps)[-1]
        text = f"action {action.action_id} {action.name} failed at {self._at(step)}"
        skill = action.skill
        if skill is None:
            return Cause(text)
        error = f": {skill.error}" if skill.error else ""
        why = f"skill {skill.skill_string} of {skill.skiller} ended {skill.status}{error}"
        return Cause(text, (Cause(why),))

    def _left_over(self, goal: Goal) -> Iterator[Cause]:
        """Yield that a goal with an outcome has not been retracted, and which rule could go on with it."""
        if goal.event.mode != "RETRACTED":
            yield Cause(self._waits_for(goal), tuple(self._rules_for(goal)))

    def _rules_for(self, goal: Goal) -> Iterator[Cause]:
        """Yield which rules could move a goal on."""
        event = goal.event
        slots = {"class": event.goal_class, "sub-type": event.sub_type, "mode": event.mode}
        names = rules_for(self._evidence.rule_texts(), slots)
        if names:
            yield Cause(f"rules that could do it ('cxbridge why RULE' tells more): {', '.join(names)}")

    # --- what it waits for --------------------------------------------------------------------------------

    def _since(self, goal: Goal) -> str:
        mode = goal.event.mode
        first = goal.steps[-1]
        for step in reversed(goal.steps):
            if not isinstance(step.event, GoalTransition) or step.event.mode != mode:
                break
            first = step
        return f"{goal.title} is {mode} since {self._at(first)}{self._formerly(goal)}"

    def _waits_for(self, goal: Goal) -> str:
        return f"{self._since(goal)}, and waits {_WAITS.get(goal.event.mode, 'for a rule')}"

    def _holdups(self, goal: Goal, depth: int) -> Iterator[Cause]:
        """Yield what a goal waits for in particular."""
        mode = goal.event.mode
        parent = self._goals.parent(goal)
        if mode == "FORMULATED" and parent is not None and depth == 0:
            yield Cause(self._since(parent), tuple(self._above(parent)))
            for other in parent.children:
                if other is not goal and other.event.mode not in ("FORMULATED", *ENDED):
                    yield Cause(f"its sibling {self._since(other)}")
        if mode == "COMMITTED":
            yield from self._resources(goal)
        held_above = mode == "FORMULATED" and parent is not None and parent.event.mode != "DISPATCHED"
        if mode != "DISPATCHED" and not held_above and depth == self._depth == 0:
            yield from self._rules_for(goal)
        if mode in ("EXPANDED", "COMMITTED", "DISPATCHED"):
            open_actions = [action for action in goal.actions if action.state not in DONE]
            if mode == "DISPATCHED" and open_actions:
                yield self._open_action(goal, open_actions[0], len(open_actions) - 1)
            for child in goal.children:
                if child.event.mode != "RETRACTED" and depth < _DEEPEST:
                    yield self._open_child(child, depth)

    def _above(self, goal: Goal) -> Iterator[Cause]:
        """Yield what a goal waits for that has not been selected: it is about the goals above it."""
        if goal.event.mode == "FORMULATED" and self._depth < _DEEPEST:
            self._depth += 1
            yield from self._holdups(goal, 0)
            self._depth -= 1

    def _open_child(self, child: Goal, depth: int) -> Cause:
        if child.ended is not None:
            return Cause(f"{self._outcome(child)}, but it is {child.event.mode}, not RETRACTED")
        return Cause(self._since(child), tuple(self._holdups(child, depth + 1)))

    def _open_action(self, goal: Goal, action: Action, more: int) -> Cause:
        text = f"action {action.action_id} {action.name} is {action.state} since {self._at(action.steps[-1])}"
        because = []
        if action.skill is not None and action.state not in ("FORMULATED", "PENDING"):
            skill = action.skill
            began = self._evidence.seconds(skill.started_us)
            because.append(
                Cause(f"skill {skill.skill_string} of {skill.skiller} is {skill.status} since {began:.3f} s")
            )
        fact = self._action_fact(goal, action)
        if action.state in ("FORMULATED", "PENDING") and fact.get("executable") == "FALSE":
            because.append(Cause("it is not executable: its precondition does not hold"))
        rest = f", {more} more after it" if more else ""
        return Cause(text + rest, tuple(because))

    def _action_fact(self, goal: Goal, action: Action) -> Mapping[str, str]:
        for slots in self._facts.get("plan-action", ()):
            if (slots.get("goal-id"), slots.get("plan-id"), slots.get("id")) == (
                goal.goal,
                action.plan,
                action.action_id,
            ):
                return slots
        return {}

    def _resources(self, goal: Goal) -> Iterator[Cause]:
        """Yield the resources that a goal needs and has not, and who has them."""
        facts = {slots.get("id", ""): slots for slots in self._facts.get("goal", ())}
        own = facts.get(goal.goal, {})
        missing = set(own.get("required-resources", "").split()) - set(
            own.get("acquired-resources", "").split()
        )
        for resource in sorted(missing):
            holders = [
                other
                for other, slots in facts.items()
                if other != goal.goal and resource in slots.get("acquired-resources", "").split()
            ]
            locks = [
                slots.get("locked-by", "")
                for slots in self._facts.get("mutex", ())
                if slots.get("name") == f"resource-{resource}" and slots.get("state") == "LOCKED"
            ]
            if holders:
                held = ": goal " + ", ".join(holders) + " has it"
            else:
                held = (
                    f": {locks[0]} has locked it" if locks and locks[0] else ", which nobody is known to have"
                )
            yield Cause(f"resource {resource}{held}")


def _state(step: Step) -> str:
    return step.event.state if isinstance(step.event, PlanActionTransition) else ""


def _ended_badly(child: Goal, before: Step) -> bool:
    step = child.ended
    return (
        step is not None
        and isinstance(step.event, GoalTransition)
        and step.event.outcome in ("FAILED", "REJECTED")
        and step.event.time_us <= before.event.time_us
    )


_WAITS: Final = {
    "FORMULATED": "for a rule that selects it",
    "SELECTED": "to be expanded: for a rule that gives it a plan or sub-goals",
    "EXPANDED": "for a rule that commits it to a plan or to a sub-goal",
    "COMMITTED": "to be dispatched, when it has its resources",
    "DISPATCHED": "for what was dispatched",
    "FINISHED": "for a rule that evaluates it",
    "EVALUATED": "for a rule that retracts it",
}
"""What a goal waits for in a mode."""
