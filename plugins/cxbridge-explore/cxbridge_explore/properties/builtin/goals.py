"""Properties of goals: each goal is retracted in the end, and no goal rests without a reason."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from functools import partial
from typing import Final

from cxbridge_explore.properties.monitor import Ending, Monitor, RunEnd, Scene
from cxbridge_explore.properties.tables import FactTables, Slots

# Default limit in seconds for a goal that stays in a mode without waiting for anything.
DEFAULT_REST_S: Final = 60.0

_RETRACTED: Final = "RETRACTED"
_GOAL, _ACTION, _CALL = "goal", "plan-action", "planner-call"
_AT_WORK: Final = frozenset(
    {"WAITING", "RUNNING", "EXECUTION-SUCCEEDED", "SENSED-EFFECTS-WAIT", "SENSED-EFFECTS-HOLD"}
)


def _goals(tables: FactTables) -> dict[str, Slots]:
    """Return the goals by id."""
    return {str(slots["id"]): slots for slots in tables.facts(_GOAL)}


def _is_maintained(goal: Slots) -> bool:
    return goal.get("type") == "MAINTAIN"


def _may_be_removed(goal: Slots) -> bool:
    """Return whether an agent may retract the fact of a goal."""
    # A goal that a rule asserts without an id is replaced by a copy with an id.
    return bool(goal["mode"] == _RETRACTED or (goal["id"] == "nil" and goal["mode"] == "FORMULATED"))


def _with_parents(goal: Slots, goals: Mapping[str, Slots]) -> Iterator[Slots]:
    """Yield a goal and its parents, each once even in a cycle."""
    lineage: dict[str, Slots] = {}
    parent: Slots | None = goal
    while parent is not None and str(parent["id"]) not in lineage:
        lineage[str(parent["id"])] = parent
        parent = goals.get(str(parent["parent"]))
    yield from lineage.values()


class GoalsRetracted(Monitor):
    """Each goal is RETRACTED in the end, or removed with a RETRACTED parent. MAINTAIN goals are exempt."""

    templates = (_GOAL,)

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        # The last slots of each goal by agent and id, for the time after the removal of its fact.
        self._last_slots: dict[FactTables, dict[str, Mapping[str, str]]] = {}

    def joined(self, tables: FactTables) -> None:
        super().joined(tables)
        goals = self._last_slots[tables] = {}
        tables.env.watcher.follow(_GOAL, partial(self._note, goals), ("id", "parent", "mode", "type"))

    def left(self, tables: FactTables) -> None:
        del self._last_slots[tables]

    @staticmethod
    def _note(goals: dict[str, Mapping[str, str]], _template: str, slots: Mapping[str, str]) -> None:
        goals[slots["id"]] = slots

    def check(self) -> None:
        """Report goals whose facts were removed too early."""
        if not self.changes.take():
            return
        for tables, last_slots in self._last_slots.items():
            goals = _goals(tables)
            self.is_evaluated |= bool(goals)
            removed = [goal for name, goal in last_slots.items() if name not in goals]
            for goal in removed:
                if not any(_may_be_removed(each) for each in _with_parents(goal, last_slots)):
                    name, mode = goal["id"], goal["mode"]
                    self.scene.report(f"goal {name} is gone, it was {mode}", goal=name)
            # Forget the goals only now, since the parents of a removed goal may be removed in the same loop.
            for goal in removed:
                del last_slots[goal["id"]]

    def end(self, end: RunEnd) -> None:
        """Report goals that are left at the end."""
        if end.ending is Ending.CUT:
            return
        for tables in self.scene.tables:
            goals = _goals(tables)
            for name, goal in goals.items():
                lineage = _with_parents(goal, goals)
                if not any(_may_be_removed(each) or _is_maintained(each) for each in lineage):
                    self.scene.report(f"goal {name} is {goal['mode']} at the end", goal=name)


class NoIdleRest(Monitor):
    """No goal stays in a mode for long without waiting for something.

    :param limit_s: the limit in seconds.
    """

    templates = (_GOAL, _ACTION, _CALL, "mutex")

    def __init__(self, scene: Scene, limit_s: float = DEFAULT_REST_S) -> None:
        super().__init__(scene)
        self._limit_s = limit_s
        # The mode of each goal that waits for nothing, and the second since which it rests; by agent and id.
        self._rests: dict[tuple[str, str], tuple[str, float]] = {}

    def left(self, tables: FactTables) -> None:
        self._rests = {key: rest for key, rest in self._rests.items() if key[0] != tables.name}

    def check(self) -> None:
        """Record resting goals, and report those that exceed the limit."""
        now = self.scene.seconds
        if self.changes.take():
            earlier, self._rests = self._rests, {}
            for tables in self.scene.tables:
                for name, mode in self._resting(tables):
                    rest = earlier.get((tables.name, name))
                    self._rests[tables.name, name] = rest if rest and rest[0] == mode else (mode, now)
            self.is_evaluated |= bool(self._rests)
        for (_, name), (mode, since) in self._rests.items():
            if now - since > self._limit_s:
                self.scene.report(
                    f"goal {name} has been {mode} for {self._limit_s:g} s and waits for nothing", goal=name
                )

    def _resting(self, tables: FactTables) -> Iterator[tuple[str, str]]:
        """Yield the id and the mode of each goal that waits for nothing."""
        goals = _goals(tables)
        busy = {str(slots["goal-id"]) for slots in tables.facts(_CALL) if slots["status"] == "RUNNING"}
        actions = tables.facts(_ACTION)
        working = {str(slots["goal-id"]) for slots in actions if slots["state"] in _AT_WORK}
        busy |= working
        if working:  # a pending action may wait for a busy Skiller, or for the effect of another action
            busy |= {str(slots["goal-id"]) for slots in actions if slots["state"] == "PENDING"}
        parents = {str(goal["parent"]) for goal in goals.values() if goal["mode"] != _RETRACTED}
        has_locks = any(slots["state"] == "LOCKED" for slots in tables.facts("mutex"))
        for name, goal in goals.items():
            mode = str(goal["mode"])
            lacks_resources = goal["required-resources"] != goal["acquired-resources"]
            waits = (
                mode == _RETRACTED
                or _is_maintained(goal)
                or name in busy
                or name in parents  # waits for its sub-goals, which are checked separately
                or (mode == "FORMULATED" and len(goals) > 1)  # waits for its selection
                or (mode == "COMMITTED" and has_locks and lacks_resources)
            )
            if not waits:
                yield name, mode

    def state(self) -> Hashable | None:
        now = self.scene.seconds
        return frozenset((*key, mode, round(now - since, 3)) for key, (mode, since) in self._rests.items())
