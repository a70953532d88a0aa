"""Properties of the resources of goals: each has one holder at most, and none whose goal is gone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cxbridge_explore.properties.monitor import Ending, Monitor, RunEnd
from cxbridge_explore.properties.tables import Changes, FactTables

_GOAL, _REQUEST, _MUTEX = "goal", "resource-request", "mutex"
_IDENTITY: Final = ("cx", "identity")


def _held(tables: FactTables) -> Iterator[tuple[str, str]]:
    """Yield resources, and the goals that have them."""
    for slots in tables.facts(_GOAL):
        for resource in slots["acquired-resources"]:
            yield str(resource), str(slots["id"])


class OneHolder(Monitor):
    """No resource has two holders at a time, of one agent or of several."""

    def begin(self) -> None:
        """Follow the goals."""
        self._changes = Changes(_GOAL)

    def joined(self, tables: FactTables) -> None:
        """Follow those of an agent."""
        self._changes.follow(tables)

    def look(self) -> None:
        """Look who has what."""
        if not self._changes.taken():
            return
        holders: dict[str, str] = {}
        for tables in self.scene.tables:
            for resource, goal in _held(tables):
                self.is_evaluated = True
                other = holders.setdefault(
                    resource, goal if len(self.scene.tables) == 1 else f"{goal} of {tables.name}"
                )
                here = goal if len(self.scene.tables) == 1 else f"{goal} of {tables.name}"
                if other != here:
                    self.scene.report(f"{other} and {here} have both got the resource {resource}", goal=goal)


class NoLostResource(Monitor):
    """No resource is held for a goal that is gone, and no lock is held when the run is over."""

    def begin(self) -> None:
        """Follow goals and requests."""
        self._changes = Changes(_GOAL, _REQUEST)

    def joined(self, tables: FactTables) -> None:
        """Follow those of an agent."""
        self._changes.follow(tables)

    def look(self) -> None:
        """Look for requests without a goal."""
        if not self._changes.taken():
            return
        for tables in self.scene.tables:
            goals = {str(slots["id"]) for slots in tables.facts(_GOAL)}
            for slots in tables.facts(_REQUEST):
                self.is_evaluated = True
                if str(slots["goal"]) not in goals:
                    self.scene.report(
                        f"the resource {slots['resource']} is held for {slots['goal']}, which is gone",
                        goal=str(slots["goal"]),
                    )

    def end(self, end: RunEnd) -> None:
        """Look for locks that were not given back."""
        for tables in self.scene.tables:
            mine = {str(slots["value"]) for slots in tables.facts("wm-fact") if slots["key"] == _IDENTITY}
            for slots in tables.facts(_MUTEX):
                self.is_evaluated = True
                if end.ending is not Ending.CUT and slots["state"] == "LOCKED" and slots["locked-by"] in mine:
                    self.scene.report(f"{slots['locked-by']} has not given back the lock {slots['name']}")
