"""Runs in memory, and the recordings of Fawkes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from cxbridge.events import Event, GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.trace.formats.base import Run
from tests.support import SHARED

RECORDINGS = SHARED / "traces" / "test-scenario"
NAMES = ("skiller-1", "skiller-2", "simulator-1")


def recording(name: str) -> Path:
    """Return the path of the text log of a recording."""
    return RECORDINGS / name / "fawkes.log"


class MemoryRun(Run):
    """A run with a list of events."""

    format = "memory"

    def __init__(self, events: Iterable[Event]) -> None:
        super().__init__(Path("memory"))
        self.events = list(events)

    def __iter__(self) -> Iterator[Event]:
        return iter(self.events)


def goal(
    goal_id: str,
    mode: str,
    outcome: str = "UNKNOWN",
    *,
    parent: str = "nil",
    goal_class: str = "WORK",
    error: str = "",
    time_us: int = 0,
) -> GoalTransition:
    details = ("()", "()", "0.0", "()")
    return GoalTransition(
        time_us, "executive", goal_id, goal_class, "nil", parent, mode, outcome, error, *details
    )


def action(goal_id: str, action_id: str, state: str, name: str = "say") -> PlanActionTransition:
    return PlanActionTransition(0, "executive", action_id, goal_id, f"{goal_id}-PLAN", name, state, "(peggy)")


def skill(text: str, status: str, msgid: int = 1) -> SkillStatus:
    return SkillStatus(0, "executive", "Skiller", text, msgid, status)


def family() -> list[Event]:
    """Return the events of a goal with two parallel children of a class, one with a plan and a skill."""
    return [
        goal("gen1", "FORMULATED"),
        goal("gen2", "FORMULATED"),
        goal("RUN-gen3", "FORMULATED", goal_class="PARENT"),
        goal("gen1", "FORMULATED", parent="RUN-gen3"),
        goal("gen2", "FORMULATED", parent="RUN-gen3"),
        goal("RUN-gen3", "SELECTED", goal_class="PARENT"),
        goal("RUN-gen3", "DISPATCHED", goal_class="PARENT"),
        goal("gen1", "SELECTED", parent="RUN-gen3"),
        goal("gen2", "SELECTED", parent="RUN-gen3"),
        action("gen1", "1", "FORMULATED"),
        goal("gen1", "EXPANDED", parent="RUN-gen3"),
        action("gen1", "1", "RUNNING"),
        skill("say{}", "S_RUNNING"),
        goal("gen2", "FINISHED", "FAILED", parent="RUN-gen3", error="NO-PLAN"),
        skill("say{}", "S_FINAL"),
        action("gen1", "1", "FINAL"),
        goal("gen1", "FINISHED", "COMPLETED", parent="RUN-gen3"),
        goal("RUN-gen3", "FINISHED", "FAILED", goal_class="PARENT", error="SUB-GOAL-FAILED gen2"),
    ]
