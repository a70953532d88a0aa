"""Explains how a goal came to its outcome, or why it waits, as a tree of causes.

The tree follows the goal's failed actions and sub-goals down to a root cause, which `goal_causes` finds.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import Final

from cxbridge.history.forest import NO_PARENT
from cxbridge.history.linking import SkillLink
from cxbridge.history.model import DONE_STATES, ActionChange, GoalChange, GoalRecord, PlanActionRecord
from cxbridge.history.outcome import ENDED_MODES
from cxbridge_studio.explain.action_diagnosis import ACTION_TEMPLATES, FAILED_STATES
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_causes import RootCauses
from cxbridge_studio.explain.goal_rules import rules_for
from cxbridge_studio.explain.goals import Goals, failed_actions

# The states of an action that the report always shows, besides the last state.
_SHOWN_STATES: Final = ("RUNNING", "EXECUTION-FAILED", "FAILED", "FINAL")
_MAX_LEVELS: Final = 20  # errors of goals may name each other in a ring, and a deeper tree is unreadable

# The cause of each change in a recording without firings.
NOT_RECORDED: Final = "which rule decided so is not known: firings were not recorded (level rules)"

# The limit of facts copied per deftemplate: copying a fact stops the loop for about 10 us.
MAX_FACTS: Final = 10_000

# The slots of facts by deftemplate, as CLIPS prints the values.
Facts = Mapping[str, list[Mapping[str, str]]]

# The templates whose facts explain why a goal waits.
FACT_TEMPLATES: Final = ("goal", "mutex", *ACTION_TEMPLATES)


@dataclass(frozen=True, slots=True)
class GoalMoment:
    """An event of a goal's life.

    :param seconds: the time since the start of the run.
    :param rules: the rules that fired just before, the latest last.
    """

    seconds: float
    text: str
    rules: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Cause:
    """A reason, with the deeper reasons for it in ``because``.

    :param root: whether this is the root cause, the place to change.
    """

    text: str
    because: tuple[Cause, ...] = ()
    root: bool = False


@dataclass(frozen=True, slots=True)
class GoalStory:
    """The report about a goal.

    :param number: the number of the goal within its class, from 1.
    :param cause: why the goal has its outcome, or why it waits.
    :param waits: whether the goal has no outcome yet.
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
    moments: tuple[GoalMoment, ...]

    @property
    def label(self) -> str:
        """The class of the goal and its number within the class."""
        return f"{self.goal_class}#{self.number}"


@dataclass(frozen=True, slots=True)
class ActionStory:
    """The report about a plan-action.

    :param goal: the id and the class of the action's goal.
    :param cause: the cause of the action's outcome or wait.
    """

    goal: str
    action: str
    cause: Cause
    moments: tuple[GoalMoment, ...]


class GoalReporter:
    """Reporter of the goals of a run.

    :param evidence: the evidence about the run; it must have a history.
    """

    def __init__(self, evidence: Evidence, goals: Goals, facts: Facts) -> None:
        self._evidence = evidence
        self._goals = goals
        self._facts = facts
        assert evidence.history is not None
        self._rules_known = evidence.history.rules_known
        self._root_causes = RootCauses(evidence, goals, facts)
        # The number of parents that are being explained, because a sub-goal waits for them.
        self._levels_above = 0

    def report(self, goal: GoalRecord) -> GoalStory:
        """Return the story of a goal."""
        waits = self.waits(goal)
        parent = self._goals.parent(goal)
        return GoalStory(
            goal.name,
            goal.goal_class,
            "" if goal.sub_type == "nil" else goal.sub_type,
            "" if goal.parent == NO_PARENT else parent.title if parent else goal.parent,
            goal.mode,
            goal.outcome,
            goal.error,
            self._goals.of_class(goal.goal_class).index(goal) + 1,
            waits,
            Cause(self._wait_text(goal), tuple(self._holdups(goal, 0)))
            if waits
            else Cause(
                self._outcome_text(goal),
                (*self._causes_of_outcome(goal, {goal.name}), *self._pending_retraction(goal)),
            ),
            tuple(self._moments(goal)),
        )

    def report_action(self, goal: GoalRecord, action: PlanActionRecord) -> ActionStory:
        """Return the story of a plan-action: why it failed or waits, and its states."""
        if action.state not in DONE_STATES:
            cause = self._open_action(goal, action, 0)
        elif action.state == "FAILED":
            cause = self._failed_action(goal, action)
        else:
            link = self._goals.skill(action)
            skill = () if link is None else (Cause(_skill_end_text(link)),)
            cause = Cause(self._state_text(action), skill)
        moments = tuple(
            GoalMoment(self._seconds(change), change.state, self._goals.rules(change))
            for change in action.changes
        )
        if not cause.because and moments:
            decision = self._decision(moments[-1].rules, f"action {action.id}", action.state)
            cause = Cause(cause.text, (decision,))
        return ActionStory(goal.title, action.id, cause, moments)

    def outcome(self, goal: GoalRecord) -> Cause:
        """Return how a goal ended, with the reasons."""
        if goal.end_change is None and goal.former_ends:
            return Cause(self._since_text(goal))
        return Cause(self._outcome_text(goal), tuple(self._causes_of_outcome(goal, {goal.name})))

    def waits(self, goal: GoalRecord) -> bool:
        """Whether a goal has not ended."""
        return goal.end_change is None and not self._is_gone(goal)

    def _is_gone(self, goal: GoalRecord) -> bool:
        """Whether the fact of a goal is retracted, as far as facts are known."""
        facts = self._facts.get("goal")
        if goal.replaced is not None or facts is None or not self._evidence.has_facts_of("goal"):
            return goal.replaced is not None
        # With as many facts as the limit, the goal may be among those that were not copied.
        return len(facts) < MAX_FACTS and all(slots.get("id") != goal.id for slots in facts)

    # --- the life of a goal

    def _moments(self, goal: GoalRecord) -> Iterator[GoalMoment]:
        """Yield the events of a goal, its actions and its sub-goals, in order."""
        changes: list[tuple[GoalChange | ActionChange, str]] = [
            (change, self._goal_text(goal, index)) for index, change in enumerate(goal.changes)
        ]
        for action in goal.actions:
            changes += [
                (change, self._action_text(action, index)) for index, change in enumerate(action.changes)
            ]
        for child in self._goals.children(goal):
            changes += [
                (change, self._child_text(child, index)) for index, change in enumerate(child.changes)
            ]
        for change, text in sorted(changes, key=lambda item: item[0].seq):
            if text:
                yield GoalMoment(self._seconds(change), text, self._goals.rules(change))

    @staticmethod
    def _goal_text(goal: GoalRecord, index: int) -> str:
        change, previous = goal.changes[index], goal.changes[index - 1]
        # A rule may give a goal a parent after the goal was formulated.
        if index and previous.mode == change.mode and previous.parent != change.parent:
            return f"becomes a sub-goal of {change.parent}"
        outcome = "" if change.outcome == "UNKNOWN" or change.mode != "FINISHED" else f" {change.outcome}"
        error = f", error: {change.error}" if change.error and change.mode == "FINISHED" else ""
        return f"{change.mode}{outcome}{error}"

    def _action_text(self, action: PlanActionRecord, index: int) -> str:
        state = action.changes[index].state
        is_last = index == len(action.changes) - 1
        if state not in _SHOWN_STATES and not (is_last and state != "FORMULATED"):
            return ""
        detail, link = "", self._goals.skill(action)
        if link is not None and state == "RUNNING":
            detail = f", {link.word}skill {link.call.skill_string}"
        elif link is not None and state in FAILED_STATES and link.call.error:
            detail = f": {link.word}{link.call.error}"
        return f"  action {action.id} {action.name} {state}{detail}"

    @staticmethod
    def _child_text(child: GoalRecord, index: int) -> str:
        change = child.changes[index]
        if index and child.changes[index - 1].mode == change.mode:
            return ""
        if change.mode == "FINISHED":
            error = f", error: {change.error}" if change.error else ""
            return f"  sub-goal {child.title} {change.outcome}{error}"
        # The other modes are steps within the sub-goal, which its own report shows.
        return f"  sub-goal {child.title} {change.mode}" if change.mode in ("SELECTED", "DISPATCHED") else ""

    # --- the cause of an outcome

    def _seconds(self, change: GoalChange | ActionChange) -> float:
        return self._evidence.seconds(self._goals.time_us(change.seq))

    def _time_text(self, change: GoalChange | ActionChange) -> str:
        return f"{self._seconds(change):.3f} s"

    def _outcome_text(self, goal: GoalRecord) -> str:
        change = goal.end_change
        if change is None:
            return f"{goal.title} was {goal.mode} when its fact was retracted"
        error = f", error: {change.error}" if change.error else ""
        former_outcomes = self._former_outcomes_text(goal)
        return f"{goal.title} {change.outcome} at {self._time_text(change)}{error}{former_outcomes}"

    def _former_outcomes_text(self, goal: GoalRecord) -> str:
        """Return the outcomes of the goal before it was formulated again."""
        ends = [f"{change.outcome} at {self._time_text(change)}" for change in goal.former_ends]
        return f"; before, it was {', '.join(ends)}" if ends else ""

    def _causes_of_outcome(self, goal: GoalRecord, reported: set[str]) -> Iterator[Cause]:
        """Yield the causes of a goal's outcome."""
        change = goal.end_change
        if change is None:
            return
        if change.outcome == "COMPLETED":
            yield from self._causes_of_completion(goal, change)
            return
        # The most certain causes first: goals that the error names, failed actions, then the last sub-goal
        # that failed before.
        culprits = [culprit for culprit in self._goals.named_in(change, goal) if culprit.name not in reported]
        causes = [
            Cause(self._outcome_text(culprit), self._deeper_causes(culprit, reported))
            for culprit in culprits
            if culprit.end_change
        ]
        if not causes:
            causes = [self._failed_action(goal, action) for action in failed_actions(goal.last_actions)]
        if not causes:
            causes = [
                Cause(self._outcome_text(child), self._deeper_causes(child, reported))
                for child in self._goals.children(goal)
                if _ended_badly(child, change) and child.name not in reported
            ][-1:]
        yield from causes or _root_causes(self._root_causes.of_planner(goal))
        yield self._goal_decision(change, goal)

    def _deeper_causes(self, goal: GoalRecord, reported: set[str]) -> tuple[Cause, ...]:
        if goal.name in reported or len(reported) > _MAX_LEVELS:
            return ()
        return tuple(self._causes_of_outcome(goal, reported | {goal.name}))

    def _goal_decision(self, change: GoalChange, goal: GoalRecord) -> Cause:
        """Return which rule ended a goal."""
        return self._decision(self._goals.rules(change), goal.name, change.outcome)

    def _decision(self, rules: Sequence[str], name: str, state: str) -> Cause:
        """Return which rule set a state: no event names the rule, so the last rule that fired counts."""
        if rules:
            return Cause(f"rule {rules[-1]} set {name} to {state}")
        if self._rules_known:
            return Cause(f"no rule fired just before {name} became {state}")
        return Cause(NOT_RECORDED)

    def _causes_of_completion(self, goal: GoalRecord, change: GoalChange) -> Iterator[Cause]:
        actions = goal.last_actions
        final_actions = [action for action in actions if action.state == "FINAL"]
        if actions:
            yield Cause(f"{len(final_actions)} of {len(actions)} actions are done")
        for child in self._goals.children(goal):
            if child.end_change is not None:
                yield Cause(self._outcome_text(child))
        yield self._goal_decision(change, goal)

    def _failed_action(self, goal: GoalRecord, action: PlanActionRecord) -> Cause:
        failed = [change for change in action.changes if change.state == "EXECUTION-FAILED"]
        change = (failed or action.changes)[-1]
        text = f"action {action.id} {action.name} failed at {self._time_text(change)}"
        link = self._goals.skill(action)
        if link is None:
            return Cause(text, tuple(_root_causes([self._root_causes.of_action(goal, action)])))
        error = f": {link.call.error}" if link.call.error else ""
        return Cause(text, (Cause(f"{_skill_end_text(link)}{error}", root=True),))

    def _pending_retraction(self, goal: GoalRecord) -> Iterator[Cause]:
        """Yield why a goal with an outcome has not been retracted, with the rules that could retract it."""
        if goal.mode != "RETRACTED" and not self._is_gone(goal):
            yield Cause(self._wait_text(goal), tuple(self._rules_for(goal)))

    def _rules_for(self, goal: GoalRecord) -> Iterator[Cause]:
        """Yield the rules that can change the goal's mode."""
        slots = {"class": goal.goal_class, "sub-type": goal.sub_type, "mode": goal.mode}
        names = rules_for(self._evidence.rule_texts(), slots)
        if names:
            yield Cause(f"rules that could do it ('cxbridge why RULE' tells more): {', '.join(names)}")

    # --- the cause of a wait

    def _since_text(self, goal: GoalRecord) -> str:
        # Changes of other slots repeat the mode.
        *_, first = takewhile(lambda change: change.mode == goal.mode, reversed(goal.changes))
        return f"{goal.title} is {goal.mode} since {self._time_text(first)}{self._former_outcomes_text(goal)}"

    def _wait_text(self, goal: GoalRecord) -> str:
        return f"{self._since_text(goal)}, and waits {_WAITS.get(goal.mode, 'for a rule')}"

    def _holdups(self, goal: GoalRecord, depth: int) -> Iterator[Cause]:
        """Yield the specific causes of a goal's wait."""
        mode = goal.mode
        parent = self._goals.parent(goal)
        if mode == "FORMULATED" and parent is not None and depth == 0:
            yield Cause(self._since_text(parent), tuple(self._parent_holdups(parent)))
            for sibling in self._goals.children(parent):
                if sibling is not goal and sibling.mode not in ("FORMULATED", *ENDED_MODES):
                    yield Cause(f"its sibling {self._since_text(sibling)}")
        # A dispatched goal waits for its actions and sub-goals; the selection of a sub-goal is up to the
        # rules for its parent.
        waits_for_parent = mode == "FORMULATED" and parent is not None and parent.mode != "DISPATCHED"
        if mode != "DISPATCHED" and not waits_for_parent:
            yield from _root_causes(self._root_causes.of_waiting(goal))
            # Only for the goal in question: the rules for related goals would bury the cause.
            yield from () if depth or self._levels_above else self._rules_for(goal)
        if mode in ("EXPANDED", "COMMITTED", "DISPATCHED"):
            yield from self._unfinished(goal, depth)

    def _unfinished(self, goal: GoalRecord, depth: int) -> Iterator[Cause]:
        """Yield the first unfinished action and the unfinished sub-goals of a goal."""
        open_actions = [action for action in goal.actions if action.state not in DONE_STATES]
        if goal.mode == "DISPATCHED" and open_actions:
            yield self._open_action(goal, open_actions[0], len(open_actions) - 1)
        for child in self._goals.children(goal):
            if child.mode != "RETRACTED" and depth < _MAX_LEVELS and not self._is_gone(child):
                yield self._open_child(child, depth)

    def _parent_holdups(self, goal: GoalRecord) -> Iterator[Cause]:
        """Yield why a parent goal has not been selected."""
        if goal.mode == "FORMULATED" and self._levels_above < _MAX_LEVELS:
            self._levels_above += 1
            yield from self._holdups(goal, 0)
            self._levels_above -= 1

    def _open_child(self, child: GoalRecord, depth: int) -> Cause:
        if child.end_change is not None:
            return Cause(f"{self._outcome_text(child)}, but it is {child.mode}, not RETRACTED")
        return Cause(self._since_text(child), tuple(self._holdups(child, depth + 1)))

    def _open_action(self, goal: GoalRecord, action: PlanActionRecord, count_after: int) -> Cause:
        because = []
        link = self._goals.skill(action)
        is_started = action.state not in ("FORMULATED", "PENDING")
        if link is not None and is_started:
            skill = link.call
            began = self._evidence.seconds(self._goals.time_us(skill.begin[0]))
            subject = f"{link.word}skill {skill.skill_string} of {skill.skiller}"
            because.append(Cause(f"{subject} is {skill.status} since {began:.3f} s"))
        if action.state not in ("WAITING", "RUNNING"):
            because = [*_root_causes([self._root_causes.of_action(goal, action)]), *because]
        if not because and not is_started and self._is_known_unexecutable(goal, action):
            because.append(Cause("it is not executable: its precondition does not hold"))
        further = f", {count_after} more after it" if count_after else ""
        return Cause(self._state_text(action) + further, tuple(because))

    def _state_text(self, action: PlanActionRecord) -> str:
        return (
            f"action {action.id} {action.name} is {action.state} since {self._time_text(action.changes[-1])}"
        )

    def _is_known_unexecutable(self, goal: GoalRecord, action: PlanActionRecord) -> bool:
        key = (goal.id, action.plan, action.id, "FALSE")
        slot_names = ("goal-id", "plan-id", "id", "executable")
        return any(tuple(map(slots.get, slot_names)) == key for slots in self._facts.get("plan-action", ()))


def _root_causes(texts: Iterable[str]) -> Iterator[Cause]:
    return (Cause(text, root=True) for text in texts if text)


def _skill_end_text(link: SkillLink) -> str:
    skill = link.call
    return f"{link.word}skill {skill.skill_string} of {skill.skiller} ended {skill.status}"


def _ended_badly(child: GoalRecord, end_of_parent: GoalChange) -> bool:
    """Whether a sub-goal failed before its parent ended."""
    change = child.end_change
    return (
        change is not None and change.outcome in ("FAILED", "REJECTED") and change.time <= end_of_parent.time
    )


# The usual cause of a wait, by mode.
_WAITS: Final = {
    "FORMULATED": "for a rule that selects it",
    "SELECTED": "to be expanded: for a rule that gives it a plan or sub-goals",
    "EXPANDED": "for a rule that commits it to a plan or to a sub-goal",
    "COMMITTED": "to be dispatched, when it has its resources",
    "DISPATCHED": "for what was dispatched",
    "FINISHED": "for a rule that evaluates it",
    "EVALUATED": "for a rule that retracts it",
}
