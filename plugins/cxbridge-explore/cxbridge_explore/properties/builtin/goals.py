"""Monitors of goals: each goal is retracted in the end, and no goal rests without a reason."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from functools import partial
from typing import Final

from cxbridge_explore.properties.monitor import Ending, Monitor, RunEnd, Scene
from cxbridge_explore.properties.tables import FactTables, Slots

# The limit in seconds for a goal that stays in a mode without waiting for anything. It is chosen freely, and
# documented in docs/explore.md.
REST_LIMIT_S: Final = 60.0

_RETRACTED: Final = "RETRACTED"
_GOAL, _ACTION, _CALL = "goal", "plan-action", "planner-call"
_WORKING_STATES: Final = frozenset(
    {"WAITING", "RUNNING", "EXECUTION-SUCCEEDED", "SENSED-EFFECTS-WAIT", "SENSED-EFFECTS-HOLD"}
)


def _goals_by_id(tables: FactTables) -> dict[str, Slots]:
    return {str(slots["id"]): slots for slots in tables.facts(_GOAL)}


def _is_maintained(goal: Slots) -> bool:
    return goal.get("type") == "MAINTAIN"


def _may_be_removed(goal: Slots) -> bool:
    """Return whether an agent may retract the fact of a goal."""
    # A goal that a rule asserts without an id is replaced by a copy with an id.
    return bool(goal["mode"] == _RETRACTED or (goal["id"] == "nil" and goal["mode"] == "FORMULATED"))


def _trace_lineage(goal: Slots, goals: Mapping[str, Slots]) -> Iterator[Slots]:
    """Yield a goal and the goals above it, each once even in a cycle."""
    lineage: dict[str, Slots] = {}
    parent: Slots | None = goal
    while parent is not None and str(parent["id"]) not in lineage:
        lineage[str(parent["id"])] = parent
        parent = goals.get(str(parent["parent"]))
    yield from lineage.values()


class GoalRetractionMonitor(Monitor):
    """Checks that each goal, or a goal above it, is RETRACTED before its removal and at the end.

    At the end, MAINTAIN goals and the goals below them are exempt.
    """

    templates = (_GOAL,)

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        # The last slots of each goal by agent and id, for the time after the removal of its fact.
        self._last_slots: dict[FactTables, dict[str, Mapping[str, str]]] = {}

    def joined(self, tables: FactTables) -> None:
        super().joined(tables)
        goals = self._last_slots[tables] = {}
        tables.env.watcher.follow(_GOAL, partial(self._store_slots, goals), ("id", "parent", "mode", "type"))

    def left(self, tables: FactTables) -> None:
        del self._last_slots[tables]

    @staticmethod
    def _store_slots(goals: dict[str, Mapping[str, str]], _template: str, slots: Mapping[str, str]) -> None:
        goals[slots["id"]] = slots

    def check(self) -> None:
        """Report goals whose facts were removed too early."""
        if not self.changes.take_pending():
            return
        for tables, last_slots in self._last_slots.items():
            goals = _goals_by_id(tables)
            self.is_evaluated |= bool(goals)
            removed_goals = [goal for goal_id, goal in last_slots.items() if goal_id not in goals]
            for goal in removed_goals:
                if not any(_may_be_removed(ancestor) for ancestor in _trace_lineage(goal, last_slots)):
                    goal_id, mode = goal["id"], goal["mode"]
                    self.scene.report(f"goal {goal_id} was removed in mode {mode}", goal=goal_id)
            # in a second loop, since the goals above a removed goal may be removed at the same time
            for goal in removed_goals:
                del last_slots[goal["id"]]

    def check_end(self, end: RunEnd) -> None:
        """Report goals that are left at the end."""
        if end.ending is Ending.CUT:
            return
        for tables in self.scene.tables:
            goals = _goals_by_id(tables)
            for goal_id, goal in goals.items():
                lineage = _trace_lineage(goal, goals)
                if not any(_may_be_removed(ancestor) or _is_maintained(ancestor) for ancestor in lineage):
                    self.scene.report(f"goal {goal_id} is {goal['mode']} at the end", goal=goal_id)


class IdleGoalMonitor(Monitor):
    """Checks that no goal stays in a mode for long without waiting for something."""

    templates = (_GOAL, _ACTION, _CALL, "mutex")

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        # By agent and id of a goal that waits for nothing: its mode, and the second at which its rest began.
        self._rests: dict[tuple[str, str], tuple[str, float]] = {}

    def left(self, tables: FactTables) -> None:
        self._rests = {
            (agent, goal): rest for (agent, goal), rest in self._rests.items() if agent != tables.name
        }

    def check(self) -> None:
        """Record resting goals, and report those that exceed the limit."""
        now_s = self.scene.seconds
        if self.changes.take_pending():
            earlier_rests, self._rests = self._rests, {}
            for tables in self.scene.tables:
                for goal_id, mode in self._find_resting_goals(tables):
                    earlier_mode, begin_s = earlier_rests.get((tables.name, goal_id), (mode, now_s))
                    self._rests[tables.name, goal_id] = mode, begin_s if earlier_mode == mode else now_s
            self.is_evaluated |= bool(self._rests)
        for (_, goal_id), (mode, begin_s) in self._rests.items():
            if now_s - begin_s > REST_LIMIT_S:
                self.scene.report(
                    f"goal {goal_id} has been {mode} for {REST_LIMIT_S:g} s and waits for nothing",
                    goal=goal_id,
                )

    def _find_resting_goals(self, tables: FactTables) -> Iterator[tuple[str, str]]:
        """Yield the id and the mode of each goal that waits for nothing."""
        goals = _goals_by_id(tables)
        busy_goal_ids = {
            str(slots["goal-id"]) for slots in tables.facts(_CALL) if slots["status"] == "RUNNING"
        }
        actions = tables.facts(_ACTION)
        working_goal_ids = {str(slots["goal-id"]) for slots in actions if slots["state"] in _WORKING_STATES}
        busy_goal_ids |= working_goal_ids
        # A pending action may wait for a busy Skiller, or for the effect of a running action.
        if working_goal_ids:
            busy_goal_ids |= {str(slots["goal-id"]) for slots in actions if slots["state"] == "PENDING"}
        parent_ids = {str(goal["parent"]) for goal in goals.values() if goal["mode"] != _RETRACTED}
        has_locks = any(slots["state"] == "LOCKED" for slots in tables.facts("mutex"))
        for goal_id, goal in goals.items():
            mode = str(goal["mode"])
            lacks_resources = goal["required-resources"] != goal["acquired-resources"]
            is_waiting = (
                mode == _RETRACTED
                or _is_maintained(goal)
                or goal_id in busy_goal_ids
                or goal_id in parent_ids  # waits for its sub-goals, which are checked separately
                or (mode == "FORMULATED" and len(goals) > 1)  # waits for its selection
                or (mode == "COMMITTED" and has_locks and lacks_resources)  # waits for a lock
            )
            if not is_waiting:
                yield goal_id, mode

    def state(self) -> Hashable:
        now_s = self.scene.seconds
        return frozenset(
            (*key, mode, round(now_s - begin_s, 3)) for key, (mode, begin_s) in self._rests.items()
        )
