"""Monitors of resources: each resource has at most one holder, and no resource outlives its goal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cxbridge_explore.properties.monitor import Ending, Monitor, RunEnd
from cxbridge_explore.properties.tables import FactTables

_GOAL, _REQUEST, _MUTEX = "goal", "resource-request", "mutex"
# The key of the wm-fact with the name of the agent. A mutex names its holder in the slot `locked-by`.
_IDENTITY_KEY: Final = ("cx", "identity")


def _find_acquired_resources(tables: FactTables) -> Iterator[tuple[str, str]]:
    """Yield each acquired resource and the id of its goal."""
    for slots in tables.facts(_GOAL):
        for resource in slots["acquired-resources"]:
            yield str(resource), str(slots["id"])


class ResourceHolderMonitor(Monitor):
    """Checks that no resource has two holders at a time: goals of one agent, or of two agents."""

    templates = (_GOAL,)

    def check(self) -> None:
        if not self.changes.take_pending():
            return
        first_holders: dict[str, str] = {}  # by resource
        for tables in self.scene.tables:
            # Goals of different agents may have the same id.
            agent = f" of {tables.name}" if len(self.scene.tables) > 1 else ""
            for resource, goal in _find_acquired_resources(tables):
                self.is_evaluated = True
                holder = f"{goal}{agent}"
                first_holder = first_holders.setdefault(resource, holder)
                if first_holder != holder:
                    self.scene.report(
                        f"{first_holder} and {holder} both hold the resource {resource}", goal=goal
                    )


class LostResourceMonitor(Monitor):
    """Checks that no resource is held for a removed goal, and no lock at the end of a run that is not cut."""

    templates = (_GOAL, _REQUEST)

    def check(self) -> None:
        if not self.changes.take_pending():
            return
        for tables in self.scene.tables:
            goal_ids = {str(slots["id"]) for slots in tables.facts(_GOAL)}
            for slots in tables.facts(_REQUEST):
                self.is_evaluated = True
                if str(slots["goal"]) not in goal_ids:
                    self.scene.report(
                        f"the resource {slots['resource']} is held for {slots['goal']}, which was removed",
                        goal=str(slots["goal"]),
                    )

    def check_end(self, end: RunEnd) -> None:
        """Report locks that are still held."""
        for tables in self.scene.tables:
            # Agents share the mutexes of the robot memory, so an agent has facts about all locks.
            identities = {
                str(slots["value"]) for slots in tables.facts("wm-fact") if slots["key"] == _IDENTITY_KEY
            }
            for slots in tables.facts(_MUTEX):
                self.is_evaluated = True
                if (
                    end.ending is not Ending.CUT
                    and slots["state"] == "LOCKED"
                    and slots["locked-by"] in identities
                ):
                    self.scene.report(f"{slots['locked-by']} has not released the lock {slots['name']}")
