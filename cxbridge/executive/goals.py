"""Observation of goals and skills in the facts, to detect the end and the result of a run.

The facts ``goal`` change while rules run: a `modify` retracts a fact and asserts another. Therefore the end
of a goal is known only between two runs of the rules, in :meth:`GoalWatch.record_ended_goals`.
"""

from __future__ import annotations

from collections import Counter, deque
from typing import Final

from msgspec import Struct

from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import NIL
from cxbridge.history.forest import NO_PARENT

MAX_ENDED_ROOTS = 1000
"""The maximum number of remembered root goals that have ended: a daemon runs for a long time."""

MAX_GOALS: Final = 10_000
"""The maximum number of goals whose last states are remembered."""

_FIRST_MODE = "FORMULATED"
_LAST_MODE = "RETRACTED"
_GOAL_SLOTS = ("id", "class", "parent", "mode", "outcome", "error", "type")
_MAINTAIN = "MAINTAIN"
_RUNNING = "S_RUNNING"
# a FORMULATED goal is not pursued yet; a FINISHED or EVALUATED goal is about to end
_MAINTAINING_MODES = frozenset({"SELECTED", "EXPANDED", "COMMITTED", "DISPATCHED"})


class GoalState(Struct, frozen=True):
    """The last known state of a goal, with texts as CLIPS prints them.

    :param goal: the goal's id.
    :param parent: the id of the parent, ``nil`` for a root goal.
    :param goal_type: ACHIEVE or MAINTAIN.
    """

    goal: str
    goal_class: str
    parent: str
    mode: str
    outcome: str
    error: str
    goal_type: str

    @property
    def is_maintaining(self) -> bool:
        """Whether the goal's own slots show that it maintains its condition."""
        return self.goal_type == _MAINTAIN and self.mode in _MAINTAINING_MODES

    @property
    def is_root(self) -> bool:
        return self.parent == NO_PARENT


class GoalWatch:
    """Follows the goals of an environment. Without an environment it has no goals.

    :ivar open_goals: the last states of goals that have a fact, by id. The next call of
        :meth:`record_ended_goals` removes a goal that has lost its fact.
    :ivar ended_roots: the ended root goals in the order of their end; at most :data:`MAX_ENDED_ROOTS`.
    :ivar outcome_counts: the number of ended root goals by outcome.
    :ivar forgotten_count: the number of goals that :meth:`all_states` leaves out, see :data:`MAX_GOALS`.
    """

    def __init__(self, env: ClipsEnvironment | None) -> None:
        self.open_goals: dict[str, GoalState] = {}
        self.ended_roots: deque[GoalState] = deque(maxlen=MAX_ENDED_ROOTS)
        self.outcome_counts: Counter[str] = Counter()
        self.forgotten_count = 0
        # the last state of each goal, by id and by the number of earlier goals with this id
        self._last_states: dict[tuple[str, int], GoalState] = {}
        self._removal_counts: Counter[str] = Counter()  # removed goals by id
        self._fact_counts: Counter[str] = Counter()  # facts by id: goals without an id share the id nil
        self._retracted_ids: set[str] = set()
        self._modified_id = ""  # id of a goal that a modify has retracted and will assert again
        self._ended_ids: set[str] = set()  # present root goals that are recorded as ended
        self._env = env
        if env is not None:
            env.watcher.follow("goal", self._record_assertion, _GOAL_SLOTS)
            env.watcher.follow_retractions("goal", self._record_retraction, ("id",))

    def _record_assertion(self, _template: str, slots: dict[str, str]) -> None:
        goal, mode = slots["id"], slots.get("mode", "")
        previous = self.open_goals.get(goal)
        if self._modified_id not in ("", goal):
            self._retracted_ids.add(self._modified_id)  # the modify changed the goal's id
        self._modified_id = ""
        if goal in self._retracted_ids and previous is not None and mode == _FIRST_MODE:
            # a goal that starts anew is another goal with the same id
            if previous.mode == _LAST_MODE:
                self._record_removal(goal)
            else:  # set back before RETRACTED: the outcome of the new life counts, not that of the former
                self._removal_counts[goal] += 1
        self._fact_counts[goal] += 1
        self._retracted_ids.discard(goal)
        self.open_goals[goal] = self._last_states[goal, self._removal_counts[goal]] = GoalState(
            goal,
            slots.get("class", ""),
            slots.get("parent", NO_PARENT),
            mode,
            slots.get("outcome", ""),
            slots.get("error", ""),
            slots.get("type", ""),
        )
        if len(self._last_states) > MAX_GOALS:
            oldest_id, earlier_count = next(iter(self._last_states))
            del self._last_states[oldest_id, earlier_count]
            self.forgotten_count += 1
            # otherwise the counts of goals that no longer exist would fill the memory, too
            if oldest_id not in self.open_goals:
                self._removal_counts.pop(oldest_id, None)

    def _record_retraction(self, _template: str, slots: dict[str, str]) -> None:
        goal = slots["id"]
        self._fact_counts[goal] -= 1
        if self._fact_counts[goal] > 0:
            return
        del self._fact_counts[goal]
        if self._env is not None and self._env.maker.is_replacing:
            self._modified_id = goal
        else:
            self._retracted_ids.add(goal)

    def record_ended_goals(self) -> None:
        """Record the root goals that have ended. To be called between runs of the rules."""
        for goal in self._retracted_ids:
            self._record_removal(goal)
        self._retracted_ids.clear()
        for state in self.roots:
            if state.mode == _LAST_MODE and state.goal not in self._ended_ids:
                self._ended_ids.add(state.goal)
                self._record_end(state)

    def _record_removal(self, goal: str) -> None:
        state = self.open_goals.pop(goal, None)
        # a FORMULATED goal without an id is not removed: the core has given it an id
        is_removed = state is not None and (goal != NIL or state.mode != _FIRST_MODE)
        if state is not None and is_removed and state.is_root and goal not in self._ended_ids:
            self._record_end(state)
        self._ended_ids.discard(goal)
        if is_removed:
            self._removal_counts[goal] += 1

    def _record_end(self, state: GoalState) -> None:
        self.ended_roots.append(state)
        self.outcome_counts[state.outcome] += 1

    def all_states(self) -> tuple[GoalState, ...]:
        """Return the last state of each goal in order of appearance, without the forgotten goals."""
        unnamed = self._last_states.get((NIL, self._removal_counts[NIL]))
        if unnamed is not None and unnamed.mode == _FIRST_MODE and NIL not in self.open_goals:
            # the core has given the goal an id, under which it has another state
            del self._last_states[NIL, self._removal_counts[NIL]]
        return tuple(self._last_states.values())

    @property
    def roots(self) -> list[GoalState]:
        """The present root goals in order of appearance."""
        return [state for state in self.open_goals.values() if state.is_root]

    @property
    def open_roots(self) -> list[GoalState]:
        """The root goals that have not ended, in order of appearance."""
        return [root for root in self.roots if root.goal not in self._ended_ids]

    @property
    def maintaining_roots(self) -> list[GoalState]:
        """The open root goals, if these and all open goals below are waiting MAINTAIN goals; else empty.

        A MAINTAIN goal with an active sub-goal of another type is working, so that the run has not ended.
        """
        roots = self.open_roots
        if not all(root.is_maintaining for root in roots):
            return []
        children: dict[str, list[GoalState]] = {}
        for state in self.open_goals.values():
            children.setdefault(state.parent, []).append(state)
        queue = list(roots)
        while queue:
            state = queue.pop()
            if state.mode != _LAST_MODE:  # the removal of a retracted goal removes its sub-goals
                if not state.is_maintaining:
                    return []
                queue += children.get(state.goal, ())
        return roots


class SkillWatch:
    """Follows the skills that rules have called, in the facts ``skill`` and ``SkillerInterface``."""

    def __init__(self, env: ClipsEnvironment) -> None:
        self._env = env
        # the fact `skill` is not enough: when the action of a skill vanishes, Fawkes' rules leave its fact
        # S_RUNNING forever, because the Skiller then shows the id of the stop message; the built-in rules
        # retract the fact immediately, while the Skiller has not stopped yet
        self._shown_calls: dict[str, tuple[str, str]] = {}  # message id and status of each Skiller
        self._called_msgids: dict[str, str] = {}  # the message id of the last call of each Skiller
        env.watcher.follow("SkillerInterface", self._record_shown_call, ("id", "msgid", "status"))
        env.watcher.follow("skill", self._record_call, ("skiller", "msgid", "status"))

    def _record_shown_call(self, _template: str, slots: dict[str, str]) -> None:
        self._shown_calls[slots.get("id", "").strip('"')] = slots.get("msgid", ""), slots.get("status", "")

    def _record_call(self, _template: str, slots: dict[str, str]) -> None:
        if slots.get("status") == _RUNNING:
            self._called_msgids[slots.get("skiller", "").strip('"')] = slots.get("msgid", "")

    @property
    def has_running_skill(self) -> bool:
        """Whether a skill that rules have called is running."""
        return any(
            self._shown_calls.get(skiller) == (msgid, _RUNNING)
            for skiller, msgid in self._called_msgids.items()
        ) or any(
            slots.get("status") == _RUNNING and str(slots.get("skiller", "")) not in self._shown_calls
            for _, _, slots in self._env.facts("skill")
        )
