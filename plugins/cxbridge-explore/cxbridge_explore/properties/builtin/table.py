"""The built-in properties by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cxbridge_explore.properties.builtin.actions import PreconditionMonitor, SingleExecutionMonitor
from cxbridge_explore.properties.builtin.ends import ErrorMonitor, RunEndMonitor, SkillerReleaseMonitor
from cxbridge_explore.properties.builtin.goals import REST_LIMIT_S, GoalRetractionMonitor, IdleGoalMonitor
from cxbridge_explore.properties.builtin.resources import LostResourceMonitor, ResourceHolderMonitor
from cxbridge_explore.properties.monitor import Monitor, Property, Scene

RUN_ENDS: Final = "run-ends"  # the name of the property that an endless run violates


def builtin_properties() -> tuple[Property, ...]:
    """Return the properties that each run of each agent should have."""
    rows: tuple[tuple[str, Callable[[Scene], Monitor], str], ...] = (
        (RUN_ENDS, RunEndMonitor, "the run reaches its end"),
        ("no-errors", ErrorMonitor, "no rule has a run-time error"),
        ("goals-retracted", GoalRetractionMonitor, "each goal is RETRACTED in the end"),
        (
            "no-idle-rest",
            IdleGoalMonitor,
            f"no goal rests in a mode for more than {REST_LIMIT_S:g} s without waiting for something",
        ),
        ("no-lost-resource", LostResourceMonitor, "no resource outlives its goal"),
        ("one-holder", ResourceHolderMonitor, "no resource has two holders"),
        ("preconditions", PreconditionMonitor, "no action starts with a false precondition"),
        ("executed-once", SingleExecutionMonitor, "nothing is executed twice"),
        ("skillers-released", SkillerReleaseMonitor, "the Skiller is released at the end"),
    )
    return tuple(Property(name, make_monitor, text, source=name) for name, make_monitor, text in rows)
