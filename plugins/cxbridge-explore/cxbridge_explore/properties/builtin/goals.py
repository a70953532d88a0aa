"""Properties of goals: each is retracted in the end, and none rests without a reason."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from functools import partial
from typing import Final

from cxbridge_explore.properties.monitor import Ending, Monitor, RunEnd, Scene
from cxbridge_explore.properties.tables import Changes, FactTables, Slots

# Default limit in seconds for a goal that stays in a mode without waiting for anything.
DEFAULT_REST_S: Final = 60.0

_RETRACTED: Final = "RETRACTED"
_GOAL, _ACTION, _CALL = "goal", "plan-action", "planner-call"
_AT_WORK: Final = frozenset(
    {"WAITING", "RUNNING", "EXECUTION-SUCCEEDED", "SENSED-EFFECTS-WAIT", "SENSED-EFFECTS-HOLD"}
)


def _goals(tables: FactTables) -> dict[str, Slots]:
    return {str(slots["id"]): slots for slots in tables.facts(_GOAL)}


def _is_maintained(goal: Slots) -> bool:
    return goal.get("type") == "MAINTAIN"


def _may_go(goal: Slots) -> bool:
    # A new goal may be replaced by a copy with an id.
    return bool(goal["mode"] == _RETRACTED or (goal["id"] == "nil" and goal["mode"] == "FORMULATED"))


def _with_parents(goal: Slots, goals: Mapping[str, Slots]) -> Iterator[Slots]:
    """Yield a goal and its parents, each once even in a cycle."""
    seen: set[str] = set()
    while str(goal["id"]) not in seen:
        seen.add(str(goal["id"]))
        yield goal
        parent = goals.get(str(goal["parent"]))
        if parent is None:
            return
        goal = parent


class GoalsRetracted(Monitor):
    """Each goal is RETRACTED in the end, or removed with a RETRACTED parent. MAINTAIN goals are exempt."""

    def begin(self) -> None:
        self._changes = Changes(_GOAL)
        self._last: dict[FactTables, dict[str, Mapping[str, str]]] = {}

    def joined(self, tables: FactTables) -> None:
        self._changes.follow(tables)
        last = self._last[tables] = {}
        tables.env.watcher.follow(_GOAL, partial(self._note, last), ("id", "parent", "mode", "type"))

    def left(self, tables: FactTables) -> None:
        del self._last[tables]

    @staticmethod
    def _note(last: dict[str, Mapping[str, str]], _template: str, slots: Mapping[str, str]) -> None:
        last[slots["id"]] = slots

    def look(self) -> None:
        """Report goals whose facts were removed too early."""
        if not self._changes.take():
            return
        for tables, last in self._last.items():
            here = _goals(tables)
            self.is_evaluated |= bool(here)
            gone = [goal for name, goal in last.items() if name not in here]
            for goal in gone:
                if not any(_may_go(each) for each in _with_parents(goal, last)):
                    name, mode = goal["id"], goal["mode"]
                    self.scene.report(f"goal {name} is gone, it was {mode}", goal=name)
            for goal in gone:
                del last[goal["id"]]

    def end(self, end: RunEnd) -> None:
        """Report goals that are left at the end."""
        if end.ending is Ending.CUT:
            return
        for tables in self.scene.tables:
            goals = _goals(tables)
            for name, goal in goals.items():
                if not any(_may_go(each) or _is_maintained(each) for each in _with_parents(goal, goals)):
                    self.scene.report(f"goal {name} is {goal['mode']} at the end", goal=name)


class NoIdleRest(Monitor):
    """No goal stays in a mode for long without waiting for something.

    :param most_s: the limit in seconds.
    """

    def __init__(self, scene: Scene, most_s: float = DEFAULT_REST_S) -> None:
        super().__init__(scene)
        self._most_s = most_s
        self._since: dict[tuple[str, str], tuple[str, float]] = {}

    def begin(self) -> None:
        self._changes = Changes(_GOAL, _ACTION, _CALL, "mutex")

    def joined(self, tables: FactTables) -> None:
        self._changes.follow(tables)

    def left(self, tables: FactTables) -> None:
        self._since = {key: since for key, since in self._since.items() if key[0] != tables.name}

    def look(self) -> None:
        """Record resting goals, and report those that exceed the limit."""
        now = self.scene.seconds
        if self._changes.take():
            earlier, self._since = self._since, {}
            for tables in self.scene.tables:
                for name, mode in self._resting(tables):
                    earlier_rest = earlier.get((tables.name, name))
                    self._since[tables.name, name] = (
                        earlier_rest if earlier_rest and earlier_rest[0] == mode else (mode, now)
                    )
            self.is_evaluated |= bool(self._since)
        for (_, name), (mode, since) in self._since.items():
            if now - since > self._most_s:
                self.scene.report(
                    f"goal {name} has been {mode} for {self._most_s:g} s and waits for nothing", goal=name
                )

    def _resting(self, tables: FactTables) -> Iterator[tuple[str, str]]:
        """Yield id and mode of the goals that wait for nothing."""
        goals = _goals(tables)
        busy = {str(slots["goal-id"]) for slots in tables.facts(_CALL) if slots["status"] == "RUNNING"}
        actions = tables.facts(_ACTION)
        working = {str(slots["goal-id"]) for slots in actions if slots["state"] in _AT_WORK}
        busy |= working
        if working:  # It may wait for a busy Skiller, or for the effect of another action.
            busy |= {str(slots["goal-id"]) for slots in actions if slots["state"] == "PENDING"}
        parents = {str(goal["parent"]) for goal in goals.values() if goal["mode"] != _RETRACTED}
        locks = any(slots["state"] == "LOCKED" for slots in tables.facts("mutex"))
        for name, goal in goals.items():
            mode = str(goal["mode"])
            waits = (
                mode == _RETRACTED
                or _is_maintained(goal)
                or name in busy
                or name in parents  # waits for its sub-goals, which are checked separately
                or (mode == "FORMULATED" and len(goals) > 1)  # waits for its selection
                or (
                    mode == "COMMITTED" and locks and goal["required-resources"] != goal["acquired-resources"]
                )
            )
            if not waits:
                yield name, mode

    def state(self) -> Hashable | None:
        now = self.scene.seconds
        return frozenset((*key, mode, round(now - since, 3)) for key, (mode, since) in self._since.items())
