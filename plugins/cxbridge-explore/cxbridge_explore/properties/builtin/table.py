"""The built-in properties by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from cxbridge_explore.properties.builtin.actions import ExecutedOnce, PreconditionsHold
from cxbridge_explore.properties.builtin.ends import NoErrors, RunEnds, SkillersReleased
from cxbridge_explore.properties.builtin.goals import DEFAULT_REST_S, GoalsRetracted, NoIdleRest
from cxbridge_explore.properties.builtin.resources import NoLostResource, OneHolder
from cxbridge_explore.properties.monitor import Monitor, Property, Scene

RUN_ENDS: Final = "run-ends"  # property that an endless run violates


def builtin_properties(rest_s: float = DEFAULT_REST_S) -> tuple[Property, ...]:
    """Return the properties that every run of every agent should have.

    :param rest_s: the limit in seconds for a goal that waits for nothing.
    """
    rows: tuple[tuple[str, Callable[[Scene], Monitor], str], ...] = (
        (RUN_ENDS, RunEnds, "the run reaches its end"),
        ("no-errors", NoErrors, "no rule has a run-time error"),
        ("goals-retracted", GoalsRetracted, "each goal is RETRACTED in the end"),
        (
            "no-idle-rest",
            partial(NoIdleRest, limit_s=rest_s),
            f"no goal rests in a mode for more than {rest_s:g} s without waiting for something",
        ),
        ("no-lost-resource", NoLostResource, "no resource outlives its goal"),
        ("one-holder", OneHolder, "no resource has two holders"),
        ("preconditions", PreconditionsHold, "no action starts with a false precondition"),
        ("executed-once", ExecutedOnce, "nothing is executed twice"),
        ("skillers-released", SkillersReleased, "the Skiller is released at the end"),
    )
    return tuple(Property(name, make, text, source=name) for name, make, text in rows)
