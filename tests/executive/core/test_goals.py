"""The outcome tables of the sequential goal sub-types in the built-in core, and resources.

The tables are those of the compatibility page on the behaviour of the CX core, section 2.
"""

from __future__ import annotations

import pytest

from cxbridge.executive.host.values import Symbol
from tests.executive.core.core_bench import Bench
from tests.executive.core.goal_bench import PREFIXES, SUB_TYPES, error, grow, lone, selected

# --- sequential sub-types: outcomes of children, pursued children, outcome of parent -----------------------


_SEQUENTIAL = [
    # kind, children, pursued, outcome, error, message
    ("run-one", "COMPLETED FAILED", "C1", "COMPLETED", "", ""),
    (
        "run-one",
        "FAILED COMPLETED",
        "C1",
        "FAILED",
        "SUB-GOAL-FAILED",
        "Sub-goal 'C1' of RUN-ONE goal '{}' has failed",
    ),
    ("run-one", "REJECTED COMPLETED", "C1 C2", "COMPLETED", "", ""),
    ("run-one", "REJECTED REJECTED", "C1 C2", "REJECTED", "SUB-GOALS-REJECTED", ""),
    ("run-all", "COMPLETED COMPLETED COMPLETED", "C1 C2 C3", "COMPLETED", "", ""),
    (
        "run-all",
        "COMPLETED FAILED COMPLETED",
        "C1 C2",
        "FAILED",
        "SUB-GOAL-FAILED C2",
        "Sub-goal 'C2' of RUN-ALL goal '{}' has failed",
    ),
    (
        "run-all",
        "REJECTED COMPLETED",
        "C1",
        "REJECTED",
        "SUB-GOAL-REJECTED",
        "Sub-goal 'C1' of RUN-ALL goal '{}' was rejected",
    ),
    ("try-all", "FAILED REJECTED COMPLETED COMPLETED", "C1 C2 C3", "COMPLETED", "", ""),
    ("try-all", "FAILED REJECTED", "C1 C2", "FAILED", "SUB-GOALS-FAILED", ""),
    ("try-all", "REJECTED REJECTED", "C1 C2", "REJECTED", "SUB-GOALS-REJECTED", ""),
]


@pytest.mark.parametrize(("kind", "children", "pursued", "outcome", "code", "message"), _SEQUENTIAL)
def test_sequential_outcomes(
    bench: Bench, kind: str, children: str, pursued: str, outcome: str, code: str, message: str
) -> None:
    parent = grow(bench, kind, *children.split())
    assert parent.startswith(f"{PREFIXES[kind]}-ROOT-gen")
    bench.tick()
    assert bench.state(parent) == ("FINISHED", outcome)
    assert error(bench, parent) == (code, message.format(parent))
    assert selected(bench) == pursued.split()
    assert bench.goal(parent)["committed-to"] == Symbol("nil")
    for child in pursued.split():
        assert bench.state(child)[0] == "RETRACTED"


@pytest.mark.parametrize(
    ("kind", "code", "name"),
    [
        ("run-one", "", "RUN-ONE"),
        ("run-all", "NO-SUB-GOALS", "RUN-ALL"),
        ("try-all", "NO-SUB-GOALS", "TRY-ALL"),
        ("run-parallel", "NO-SUB-GOALS", "RUN-PARALLEL"),
        ("retry", "NO-SUB-GOAL", "RETRY"),
        ("timeout", "NO-SUB-GOAL", "TIMEOUT"),
    ],
)
def test_goal_without_children_fails(bench: Bench, kind: str, code: str, name: str) -> None:
    params = {"retry": ("max-tries", 2), "timeout": ("timeout", 1.0)}.get(kind, ())
    lone(bench, kind, *params)
    bench.tick()
    assert bench.state("P") == ("FINISHED", "FAILED")
    assert error(bench, "P") == (code, f"No sub-goal for {name} goal 'P'")


def test_greatest_priority_runs_first(bench: Bench) -> None:
    for number, priority in enumerate((1.0, 7.5, 3.0), 1):
        bench.env.eval(
            f"(assert (goal (id C{number}) (class WILL-COMPLETED) (parent P) (priority {priority})))"
        )
    lone(bench, "run-all")
    bench.tick()
    assert selected(bench) == ["C2", "C3", "C1"]


# --- resources ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", list(SUB_TYPES))
def test_dispatch_waits_for_required_resources(bench: Bench, kind: str) -> None:
    option = {"retry": "2", "timeout": "9.0", "run-parallel": "NONE"}.get(kind, "")
    parent = grow(bench, kind, "COMPLETED", option=option)
    bench.modify("goal", "(required-resources r1 r2) (acquired-resources r1)", id=parent)
    bench.tick()
    assert bench.state(parent)[0] == "COMMITTED"
    assert bench.state("C1")[0] == "FORMULATED"
    bench.modify("goal", "(acquired-resources r3 r2 r1)", id=parent)
    bench.tick()
    assert bench.state(parent) == ("FINISHED", "COMPLETED")


@pytest.mark.parametrize("kind", list(SUB_TYPES))
@pytest.mark.parametrize("outcome", ["COMPLETED", "FAILED", "REJECTED"])
def test_child_with_resources_is_not_finished(bench: Bench, kind: str, outcome: str) -> None:
    option = {"retry": "1", "timeout": "9.0", "run-parallel": "NONE"}.get(kind, "")
    parent = grow(bench, kind, outcome, option=option)
    bench.modify("goal", "(acquired-resources r1)", id="C1")
    bench.tick()
    assert bench.state(parent)[0] == "DISPATCHED"
    assert bench.state("C1") == ("RETRACTED", outcome)
    bench.modify("goal", "(acquired-resources)", id="C1")
    bench.tick()
    assert bench.state(parent) == ("FINISHED", outcome)
