"""The scenario `waypoints`: a robot drives to eight waypoints by seven moves."""

from __future__ import annotations

import math
from typing import Any

import pytest

from cxbridge.event_kinds import View
from cxbridge.events import InterfaceWrite, PlanActionTransition
from cxbridge.run import RunOptions, run_scenario
from cxbridge.run.agent import Run
from cxbridge.space.navgraph import load_navgraph
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.registry import open_run
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "waypoints"
WAYPOINTS = ["wp-init", *(f"wp{n}" for n in range(1, 7)), "wp-final"]


class RecordedRun:
    """The actions, poses and domain facts of a run."""

    def __init__(self, **options: Any) -> None:
        self.actions: list[PlanActionTransition] = []
        self.poses: list[tuple[int, tuple[float, ...], tuple[float, ...]]] = []
        with Run(RunOptions(scenario=SCENARIO, skiller="none", **options)) as cx_run:
            cx_run.bus.subscribe(self._note, PlanActionTransition, InterfaceWrite)
            cx_run.start()
            cx_run.loop.run(lambda: cx_run.is_over or cx_run.loop.cycle_count > 3000)
            self.is_over = cx_run.is_over
            self.domain = {
                (str(slots["name"]), *map(str, slots["param-values"]))
                for _, _, slots in cx_run.executive.env.facts("domain-fact")
            }

    def _note(self, event: Any) -> None:
        if isinstance(event, PlanActionTransition):
            self.actions.append(event)
        elif event.uid == "Position3DInterface::Pose":
            self.poses.append((event.time_us, event.values["translation"], event.values["rotation"]))


@pytest.fixture(scope="module")
def run():
    return RecordedRun()


def test_run_has_seven_moves_in_sequence(run):
    assert run.is_over
    states = [(event.action, event.state) for event in run.actions]
    assert {name for name, _ in states} == {"move"}
    assert [state for _, state in states].count("FINAL") == 7
    assert [state for _, state in states].count("RUNNING") == 7
    assert not any(state in ("FAILED", "EXECUTION-FAILED") for _, state in states)


def test_robot_visits_all_waypoints_and_stops_at_last(run):
    assert {f"visited {name}" for name in WAYPOINTS} <= {" ".join(fact) for fact in run.domain}
    assert [fact for fact in run.domain if fact[0] == "at"] == [("at", "tb3", "wp-final")]


def test_pose_passes_waypoints_in_order_within_speed_limit(run):
    graph = load_navgraph(SCENARIO / "navgraph.yaml")
    remaining = [node for name in WAYPOINTS if (node := graph.node(name))]
    assert len(remaining) == 8
    for (before_us, (x0, y0, _), _), (time_us, (x, y, _), _) in zip(run.poses, run.poses[1:], strict=False):
        assert math.hypot(x - x0, y - y0) <= 0.22 * (time_us - before_us) / 1e6 + 1e-6
    for _, (x, y, _), _ in run.poses:
        if remaining and math.hypot(x - remaining[0].x, y - remaining[0].y) < 0.01:
            remaining.pop(0)
    assert remaining == []
    assert run.poses[-1][2] == (0.0, 0.0, pytest.approx(0.0, abs=1e-6), pytest.approx(1.0))


def test_repeated_runs_succeed_with_same_transitions(tmp_path):
    traces = [tmp_path / "a.mcap", tmp_path / "b.mcap"]
    for trace in traces:
        result = run_scenario(RunOptions(scenario=SCENARIO, trace=trace))
        assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
        assert 20 < result.run_seconds < 60
    runs = [open_run(trace) for trace in traces]
    assert compare_runs(runs[0], runs[1:], View.TRANSITIONS, Order.TOTAL).same
