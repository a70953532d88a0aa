"""The built-in properties by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from cxbridge_explore.properties.builtin.actions import PreconditionMonitor, SingleExecutionMonitor
from cxbridge_explore.properties.builtin.ends import ErrorMonitor, RunEndMonitor, SkillerReleaseMonitor
from cxbridge_explore.properties.builtin.goals import DEFAULT_REST_S, GoalRetractionMonitor, IdleGoalMonitor
from cxbridge_explore.properties.builtin.resources import LostResourceMonitor, ResourceHolderMonitor
from cxbridge_explore.properties.monitor import Monitor, Property, Scene

RUN_ENDS: Final = "run-ends"  # the name of the property that an endless run violates


def builtin_properties(rest_s: float = DEFAULT_REST_S) -> tuple[Property, ...]:
    """Return the properties that each run of each agent should have.

    :param rest_s: the limit in seconds for a goal that waits for nothing.
    """
    rows: tuple[tuple[str, Callable[[Scene], Monitor], str], ...] = (
        (RUN_ENDS, RunEndMonitor, "the run reaches its end"),
        ("no-errors", ErrorMonitor, "no rule has a run-time error"),
        ("goals-retracted", GoalRetractionMonitor, "each goal is RETRACTED in the end"),
        (
            "no-idle-rest",
            partial(IdleGoalMonitor, limit_s=rest_s),
            f"no goal rests in a mode for more than {rest_s:g} s without waiting for something",
        ),
        ("no-lost-resource", LostResourceMonitor, "no resource outlives its goal"),
        ("one-holder", ResourceHolderMonitor, "no resource has two holders"),
        ("preconditions", PreconditionMonitor, "no action starts with a false precondition"),
        ("executed-once", SingleExecutionMonitor, "nothing is executed twice"),
        ("skillers-released", SkillerReleaseMonitor, "the Skiller is released at the end"),
    )
    return tuple(Property(name, make, text, source=name) for name, make, text in rows)
