"""Explains how a goal came to its outcome, or why it waits, as a tree of causes.

A cause may have deeper causes: a goal failed because a sub-goal failed, because an action failed. The tree
follows the goal's failed actions and sub-goals down to a root cause, the place to change, which `goal_causes`
finds.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import Final

from cxbridge.history.forest import NO_PARENT
from cxbridge.history.linking import SkillLink
from cxbridge.history.model import (
    DONE_STATES,
    PLAN_ACTION,
    SKILL_FINAL,
    GoalChange,
    GoalRecord,
    PlanActionRecord,
    read_assignment,
)
from cxbridge.history.outcome import ENDED_MODES
from cxbridge_studio.explain.action_diagnosis import ACTION_TEMPLATES, FAILED_STATES
from cxbridge_studio.explain.cause import CERTAIN_ROOT, Cause
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.goal_causes import RootCauseFinder
from cxbridge_studio.explain.goal_rules import find_mode_changing_rules
from cxbridge_studio.explain.goals import Goals, find_failed_actions
from cxbridge_studio.explain.waiting_rules import WaitingRules

# The states of an action that the story always shows; it also shows the last state, except FORMULATED.
_SHOWN_STATES: Final = ("RUNNING", "EXECUTION-FAILED", "FAILED", "FINAL")
# The limit of the tree's depth: errors of goals may name each other in a ring, and a deeper tree is
# unreadable.
_MAX_LEVELS: Final = 20

# The text in place of the deciding rule in a recording without firings.
NOT_RECORDED: Final = "the rule that decided this is unknown: firings were not recorded (level rules)"

# The text before the rules that can make a goal's next step, if their matches are unknown.
RULES_THAT_COULD: Final = "rules that could do so"

# The limit of the copied facts of a deftemplate or of a rule: copying a fact stops the loop for about 10 us.
MAX_COPIED_FACTS: Final = 10_000

# The templates whose facts explain why a goal waits.
FACT_TEMPLATES: Final = ("goal", *ACTION_TEMPLATES)


@dataclass(frozen=True, slots=True)
class GoalMoment:
    """An event in the life of a goal or of a plan-action.

    :param seconds: the time since the start of the run.
    :param rules: the rules that fired just before, the latest last.
    """

    seconds: float
    text: str
    rules: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class GoalStory:
    """The life of a goal, with the cause of its outcome or of its wait.

    :param parent: the title of the parent, or its id if its goal is unknown; empty without a parent.
    :param number: the number of the goal within its class, from 1.
    :param cause: why the goal has its outcome, or why it waits.
    :param waits: whether the goal can still get an outcome: it has none, and its fact is not retracted.
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

    @property
    def is_completed(self) -> bool:
        """Whether the goal has reached its aim, and is not tried again."""
        return self.outcome == "COMPLETED" and not self.waits


@dataclass(frozen=True, slots=True)
class ActionStory:
    """The states of a plan-action, with the cause of its outcome or of its wait.

    :param goal: the id and the class of the action's goal.
    :param action: the id of the action.
    :param cause: why the action has its outcome, or why it waits.
    """

    goal: str
    action: str
    cause: Cause
    moments: tuple[GoalMoment, ...]


class GoalStoryWriter:
    """Writes the stories of a run's goals and plan-actions.

    :ivar goals: the goals of the run.
    """

    def __init__(self, evidence: Evidence) -> None:
        self.goals = Goals(evidence.history)
        self._evidence = evidence
        self._facts = {template: evidence.read_fact_slots(template) for template in FACT_TEMPLATES}
        self._root_cause_finder = RootCauseFinder(evidence, self.goals, self._facts)
        self._waiting_rules = WaitingRules(
            evidence,
            {
                goal.id: self._describe_outcome(goal)
                for goal in self.goals.records
                if goal.end_change is not None
            },
        )

    def write_goal_story(self, goal: GoalRecord) -> GoalStory:
        """Return the story of a goal."""
        waits = self.is_waiting(goal)
        parent = self.goals.parent(goal)
        return GoalStory(
            goal.name,
            goal.goal_class,
            "" if goal.sub_type == "nil" else goal.sub_type,
            "" if goal.parent == NO_PARENT else parent.title if parent else goal.parent,
            goal.mode,
            goal.outcome,
            goal.error,
            self.goals.find_class_members(goal.goal_class).index(goal) + 1,
            waits,
            Cause(self._describe_wait(goal), tuple(self._find_wait_causes(goal, 0)))
            if waits
            else Cause(
                self._describe_outcome(goal),
                (*self._find_outcome_causes(goal, {goal.name}), *self._find_retraction_wait_causes(goal)),
            ),
            tuple(self._list_goal_moments(goal)),
        )

    def write_action_story(self, goal: GoalRecord, action: PlanActionRecord) -> ActionStory:
        """Return the story of a plan-action."""
        if action.state not in DONE_STATES:
            cause = self._find_open_action_cause(goal, action, 0)
        elif action.state == "FAILED":
            cause = self._find_action_failure_cause(goal, action)
        else:
            link = self.goals.find_skill_link(action)
            skill_causes = () if link is None else (Cause(_describe_skill_end(link)),)
            cause = Cause(self._describe_action_state(action), skill_causes)
        moments = tuple(
            GoalMoment(
                self._compute_seconds(change.seq), change.state, self.goals.find_rules_before(change.seq)
            )
            for change in action.changes
        )
        if not cause.because:
            decision_cause = self._make_decision_cause(moments[-1].rules, f"action {action.id}", action.state)
            cause = Cause(cause.text, (decision_cause,))
        return ActionStory(goal.title, action.id, cause, moments)

    def find_outcome_cause(self, goal: GoalRecord) -> Cause:
        """Return how a goal ended, with the reasons.

        For a goal that was formulated again and has no new outcome, return its present mode without reasons.
        """
        if goal.end_change is None and goal.former_end_changes:
            return Cause(self._describe_mode(goal))
        return Cause(self._describe_outcome(goal), tuple(self._find_outcome_causes(goal, {goal.name})))

    def is_waiting(self, goal: GoalRecord) -> bool:
        """Return whether a goal can still get an outcome: it has none, and its fact is not retracted."""
        return goal.end_change is None and not self._is_retracted(goal)

    def _is_retracted(self, goal: GoalRecord) -> bool:
        """Return whether the fact of a goal is retracted, as far as facts are known."""
        if goal.replaced_seq is not None or not self._evidence.has_facts("goal"):
            return goal.replaced_seq is not None
        facts = self._facts["goal"]
        # With as many facts as the limit, the goal may be among those that were not copied.
        return len(facts) < MAX_COPIED_FACTS and all(slots.get("id") != goal.id for slots in facts)

    # --- the life of a goal

    def _list_goal_moments(self, goal: GoalRecord) -> list[GoalMoment]:
        """Return the events of a goal, its actions and its sub-goals, in order."""
        texts_by_seq = {
            change.seq: self._describe_goal_change(goal, index) for index, change in enumerate(goal.changes)
        }
        texts_by_seq |= {
            change.seq: self._describe_action_change(action, index)
            for action in goal.actions
            for index, change in enumerate(action.changes)
        }
        texts_by_seq |= {
            change.seq: self._describe_child_change(child, index)
            for child in self.goals.children(goal)
            for index, change in enumerate(child.changes)
        }
        return [
            GoalMoment(self._compute_seconds(seq), text, self.goals.find_rules_before(seq))
            for seq, text in sorted(texts_by_seq.items())
            if text
        ]

    @staticmethod
    def _describe_goal_change(goal: GoalRecord, index: int) -> str:
        """Return the text of a goal's change, given by its index."""
        change, previous_change = goal.changes[index], goal.changes[index - 1]
        # A rule may give a goal a parent after the goal was formulated.
        if index and previous_change.mode == change.mode and previous_change.parent != change.parent:
            return f"becomes a sub-goal of {change.parent}"
        if change.mode != "FINISHED":
            return change.mode
        outcome = "" if change.outcome == "UNKNOWN" else f" {change.outcome}"
        return f"{change.mode}{outcome}{_describe_error(change)}"

    def _describe_action_change(self, action: PlanActionRecord, index: int) -> str:
        """Return the text of an action's change; empty if the story omits the change."""
        state = action.changes[index].state
        is_last = index == len(action.changes) - 1
        if state not in _SHOWN_STATES and not (is_last and state != "FORMULATED"):
            return ""
        detail, link = "", self.goals.find_skill_link(action)
        if link is not None and state == "RUNNING":
            detail = f", {link.guess_prefix}skill {link.call.skill_string}"
        elif link is not None and state in FAILED_STATES and link.call.error:
            detail = f": {link.guess_prefix}{link.call.error}"
        return f"  action {action.id} {action.name} {state}{detail}"

    @staticmethod
    def _describe_child_change(child: GoalRecord, index: int) -> str:
        """Return the text of a sub-goal's change; empty if the story of the parent omits the change."""
        change = child.changes[index]
        if index and child.changes[index - 1].mode == change.mode:
            return ""
        if change.mode == "FINISHED":
            return f"  sub-goal {child.title} {change.outcome}{_describe_error(change)}"
        # The other modes are steps within the sub-goal, which its own report shows.
        return f"  sub-goal {child.title} {change.mode}" if change.mode in ("SELECTED", "DISPATCHED") else ""

    # --- the cause of an outcome

    def _compute_seconds(self, seq: int) -> float:
        """Return the time of an event of the history, in seconds since the start of the run."""
        return self._evidence.compute_seconds(self.goals.time_us(seq))

    def format_time(self, seq: int) -> str:
        """Return the time of an event of the history since the start of the run, as text."""
        return f"{self._compute_seconds(seq):.3f} s"

    def _describe_outcome(self, goal: GoalRecord) -> str:
        change = goal.end_change
        if change is None:
            return f"{goal.title} was {goal.mode} when its fact was retracted"
        end = f"{change.outcome} at {self.format_time(change.seq)}{_describe_error(change)}"
        return f"{goal.title} {end}{self._describe_former_outcomes(goal)}"

    def _describe_former_outcomes(self, goal: GoalRecord) -> str:
        """Return the outcomes of the goal before it was formulated again."""
        ends = [f"{change.outcome} at {self.format_time(change.seq)}" for change in goal.former_end_changes]
        return f"; before that, it was {', '.join(ends)}" if ends else ""

    def _find_outcome_causes(self, goal: GoalRecord, path_names: set[str]) -> Iterator[Cause]:
        """Yield the causes of a goal's outcome, then the rule that ended the goal; none for an open goal.

        :param path_names: the names of the goals from the root of the tree to this goal.
        """
        change = goal.end_change
        if change is None:
            return
        if change.outcome == "COMPLETED":
            yield from self._find_completion_causes(goal)
        else:
            # Only the most certain kind of causes: the goals that the error names, else the failed actions,
            # else the last sub-goal that failed before the goal ended, else the planner.
            yield from (
                [
                    Cause(self._describe_outcome(culprit), self._find_deeper_causes(culprit, path_names))
                    for culprit in self.goals.find_goals_named_in_error(change, goal)
                    if culprit.name not in path_names and culprit.end_change
                ]
                or [
                    self._find_action_failure_cause(goal, action)
                    for action in find_failed_actions(goal.last_actions)
                ]
                or [
                    Cause(self._describe_outcome(child), self._find_deeper_causes(child, path_names))
                    for child in self.goals.children(goal)
                    if _failed_in_last_attempt(child, goal.former_seq, change)
                    and child.name not in path_names
                ][-1:]
                or _make_root_causes(self._root_cause_finder.find_planner_cause(goal))
            )
        rules = self.goals.find_rules_before(change.seq)
        yield self._make_decision_cause(rules, goal.name, change.outcome)

    def _find_deeper_causes(self, goal: GoalRecord, path_names: set[str]) -> tuple[Cause, ...]:
        """Return the causes of a related goal's outcome.

        There are none if the goal is already above itself in the tree, or the tree is too deep.
        """
        if goal.name in path_names or len(path_names) > _MAX_LEVELS:
            return ()
        return tuple(self._find_outcome_causes(goal, path_names | {goal.name}))

    def _make_decision_cause(self, rules: Sequence[str], name: str, state: str) -> Cause:
        """Return the rule that set a state: no event names this rule, so the last rule that fired counts."""
        if rules:
            return Cause(f"rule {rules[-1]} set {name} to {state}")
        if self._evidence.history.has_firings:
            return Cause(f"no rule fired just before {name} became {state}")
        return Cause(NOT_RECORDED)

    def _find_completion_causes(self, goal: GoalRecord) -> Iterator[Cause]:
        """Yield the work that completed a goal."""
        if actions := goal.last_actions:
            done_count = sum(action.state == "FINAL" for action in actions)
            yield Cause(f"{done_count} of {len(actions)} actions are done")
        for child in self.goals.children(goal):
            if child.end_change is not None:
                yield Cause(self._describe_outcome(child))

    def _find_action_failure_cause(self, goal: GoalRecord, action: PlanActionRecord) -> Cause:
        """Return the failure of an action, with the end of its skill or the root cause."""
        # The core sets EXECUTION-FAILED when the skill ends, and FAILED at a later firing.
        skill_failures = [change for change in action.changes if change.state == "EXECUTION-FAILED"]
        time_text = self.format_time((skill_failures or action.changes)[-1].seq)
        link = self.goals.find_skill_link(action)
        cause_text = "" if link is None else _describe_skill_end(link)
        if link is None or link.call.status == SKILL_FINAL:  # only the facts have the reason
            rule_text = cause_text and f"{cause_text}, then a rule set the action to FAILED"
            cause_text = self._root_cause_finder.find_action_cause(goal, action) or rule_text
        return Cause(
            f"{_describe_action(action)} failed at {time_text}", tuple(_make_root_causes([cause_text]))
        )

    def _find_retraction_wait_causes(self, goal: GoalRecord) -> Iterator[Cause]:
        """Yield why a goal with an outcome has not been retracted, with the rules that can retract it."""
        if goal.mode != "RETRACTED" and not self._is_retracted(goal):
            yield Cause(self._describe_wait(goal), tuple(self._find_rule_causes(goal)))

    def _find_rule_causes(self, goal: GoalRecord) -> Iterator[Cause]:
        """Yield why each rule that can change the goal's mode does not fire.

        If the matches of all these rules are unknown, a single cause lists the rules.
        """
        slots = {"class": goal.goal_class, "sub-type": goal.sub_type, "mode": goal.mode}
        names = find_mode_changing_rules(self._evidence.read_rule_texts(), slots)
        causes = [cause for name in names if (cause := self._waiting_rules.explain(name)) is not None]
        yield from causes
        if names and not causes:
            yield Cause(f"{RULES_THAT_COULD}: {', '.join(names)}")

    # --- the cause of a wait

    def _describe_mode(self, goal: GoalRecord) -> str:
        # The first change with the current mode: later changes of other slots repeat the mode.
        *_, first_change = takewhile(lambda change: change.mode == goal.mode, reversed(goal.changes))
        begin_text, former_outcomes = (
            self.format_time(first_change.seq),
            self._describe_former_outcomes(goal),
        )
        return f"{goal.title} has been {goal.mode} since {begin_text}{former_outcomes}"

    def _describe_wait(self, goal: GoalRecord) -> str:
        return f"{self._describe_mode(goal)}, and waits {_WAIT_REASONS.get(goal.mode, 'for a rule')}"

    def _find_wait_causes(self, goal: GoalRecord, depth: int, parent_depth: int = 0) -> Iterator[Cause]:
        """Yield the causes of a goal's wait other than the usual cause of its mode.

        :param depth: the number of levels by which this goal is below the explained goal; else 0.
        :param parent_depth: the number of levels by which this goal is above the explained goal; else 0.
        """
        mode = goal.mode
        parent = self.goals.parent(goal)
        if mode == "FORMULATED" and parent is not None and depth == 0:
            # A sub-goal that waits for its parent has the causes of the parent's wait.
            is_followed = parent.mode == "FORMULATED" and parent_depth < _MAX_LEVELS
            causes = self._find_wait_causes(parent, 0, parent_depth + 1) if is_followed else ()
            yield Cause(self._describe_mode(parent), tuple(causes))
            for sibling in self.goals.children(parent):
                if sibling is not goal and sibling.mode not in ("FORMULATED", *ENDED_MODES):
                    yield Cause(f"its sibling {self._describe_mode(sibling)}")
        # A dispatched goal waits for its actions and sub-goals; the selection of a sub-goal is up to the
        # rules for its parent.
        waits_for_parent = mode == "FORMULATED" and parent is not None and parent.mode != "DISPATCHED"
        if mode != "DISPATCHED" and not waits_for_parent:
            yield from _make_root_causes(self._root_cause_finder.find_wait_causes(goal))
            # The rules for a goal above the explained goal are not listed. A sub-goal that is not selected
            # waits for the rules of its parent.
            if not parent_depth and (not depth or mode != "FORMULATED"):
                yield from self._find_rule_causes(goal)
        if mode in ("EXPANDED", "COMMITTED", "DISPATCHED"):
            yield from self._find_unfinished_work_causes(goal, depth)

    def _find_unfinished_work_causes(self, goal: GoalRecord, depth: int) -> Iterator[Cause]:
        """Yield the first unfinished action of a dispatched goal, and the sub-goals not yet retracted."""
        open_actions = [action for action in goal.last_actions if action.state not in DONE_STATES]
        if goal.mode == "DISPATCHED" and open_actions:
            yield self._find_open_action_cause(goal, open_actions[0], len(open_actions) - 1)
        # A blocked action is more certain than a goal that may wait for the end of another goal.
        yield from sorted(
            (
                self._find_open_child_cause(child, depth)
                for child in self.goals.children(goal)
                if child.mode != "RETRACTED" and depth < _MAX_LEVELS and not self._is_retracted(child)
            ),
            key=lambda cause: -cause.certainty,
        )

    def _find_open_child_cause(self, child: GoalRecord, depth: int) -> Cause:
        """Return why a sub-goal is not retracted."""
        if child.end_change is not None:
            return Cause(f"{self._describe_outcome(child)}, but it is {child.mode}, not RETRACTED")
        return Cause(self._describe_mode(child), tuple(self._find_wait_causes(child, depth + 1)))

    def _find_open_action_cause(self, goal: GoalRecord, action: PlanActionRecord, count_after: int) -> Cause:
        """Return the state of an unfinished action, with the causes.

        :param count_after: the number of further unfinished actions of the plan.
        """
        link = self.goals.find_skill_link(action)
        is_started = action.state not in ("FORMULATED", "PENDING")
        causes: list[Cause] = []
        if link is not None and is_started:
            subject = f"{link.guess_prefix}skill {link.call.skill_string} of {link.call.skiller}"
            begin_text = self.format_time(link.call.begin.seq)
            causes = [Cause(f"{subject} has been {link.call.status} since {begin_text}")]
        if action.state not in ("WAITING", "RUNNING"):
            roots = [*_make_root_causes([self._root_cause_finder.find_action_cause(goal, action)])]
            causes = [*roots, *(self._find_plan_cause(goal) if roots and not is_started else ()), *causes]
        if not causes and not is_started and self._is_known_unexecutable(action):
            causes = [Cause("it is not executable: its precondition does not hold")]
        further_text = f", {count_after} more after it" if count_after else ""
        return Cause(self._describe_action_state(action) + further_text, tuple(causes))

    def _describe_action_state(self, action: PlanActionRecord) -> str:
        return (
            f"{_describe_action(action)} of {action.goal} has been {action.state} "
            f"since {self.format_time(action.changes[-1].seq)}"
        )

    def _find_plan_cause(self, goal: GoalRecord) -> Iterator[Cause]:
        """Yield the rule that made the present plan of a goal; none if firings are unknown."""
        return (
            Cause(f"rule {rule} made the plan at {self.format_time(change.seq)}")
            for change in [change for change in goal.changes if change.mode == "EXPANDED"][-1:]
            for rule in self.goals.find_rules_before(change.seq)[-1:]
        )

    def _is_known_unexecutable(self, action: PlanActionRecord) -> bool:
        """Return whether the fact of an action says that its precondition does not hold."""
        return any(
            slots.get("executable") == "FALSE"
            and read_assignment(slots)[0] == (action.goal, action.plan, action.id)
            for slots in self._facts[PLAN_ACTION]
        )


def _make_root_causes(texts: Iterable[str]) -> Iterator[Cause]:
    """Yield a root cause for each text that is not empty."""
    return (Cause(text, root=CERTAIN_ROOT) for text in texts if text)


def _describe_action(action: PlanActionRecord) -> str:
    """Return the id, the name and the arguments of an action."""
    return f"action {action.id} {action.name}{action.params.replace('()', '')}"


def _describe_skill_end(link: SkillLink) -> str:
    """Return how the skill of an action ended, with the error of a failed skill."""
    call = link.call
    error = f": {call.error}" if call.error else ""
    return f"{link.guess_prefix}skill {call.skill_string} of {call.skiller} ended {call.status}{error}"


def _describe_error(change: GoalChange) -> str:
    """Return the error of a goal's change, as the end of a text; empty without an error."""
    return f", error: {change.error}" if change.error else ""


def _failed_in_last_attempt(child: GoalRecord, begin_seq: int, end_of_parent: GoalChange) -> bool:
    """Return whether a sub-goal failed in the last attempt of its parent, before the parent ended.

    :param begin_seq: the seq of the last change before the attempt; 0 for the first attempt.
    """
    change = child.end_change
    return (
        change is not None
        and change.outcome in ("FAILED", "REJECTED")
        and change.seq >= begin_seq
        and change.time <= end_of_parent.time
    )


# The usual cause of a wait by mode, as the end of a sentence.
_WAIT_REASONS: Final = {
    "FORMULATED": "for a rule that selects it",
    "SELECTED": "to be expanded: for a rule that gives it a plan or sub-goals",
    "EXPANDED": "for a rule that commits it to a plan or to a sub-goal",
    "COMMITTED": "to be dispatched, when it has its resources",
    "DISPATCHED": "for its actions and sub-goals",
    "FINISHED": "for a rule that evaluates it",
    "EVALUATED": "for a rule that retracts it",
}
