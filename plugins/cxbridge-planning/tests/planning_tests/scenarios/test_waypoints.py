"""scenarios/waypoints: one robot drives over eight waypoints, by seven moves, the same way each time."""

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


class Drive:
    """A run with its actions and poses."""

    def __init__(self, **options: Any) -> None:
        self.actions: list[PlanActionTransition] = []
        self.poses: list[tuple[int, tuple[float, ...], tuple[float, ...]]] = []
        with Run(RunOptions(scenario=SCENARIO, skiller="none", **options)) as assembly:
            assembly.bus.subscribe(self._note, PlanActionTransition, InterfaceWrite)
            assembly.start()
            assembly.loop.run(lambda: assembly.is_over or assembly.loop.cycle_count > 3000)
            self.over = assembly.is_over
            self.domain = {
                (str(slots["name"]), *map(str, slots["param-values"]))
                for _, _, slots in assembly.executive.env.facts("domain-fact")
            }

    def _note(self, event: Any) -> None:
        if isinstance(event, PlanActionTransition):
            self.actions.append(event)
        elif event.uid == "Position3DInterface::Pose":
            self.poses.append((event.time_us, event.values["translation"], event.values["rotation"]))


@pytest.fixture(scope="module")
def run():
    return Drive()


def test_seven_moves_one_after_the_other(run):
    assert run.over
    states = [(event.action, event.state) for event in run.actions]
    assert {name for name, _ in states} == {"move"}
    assert [state for _, state in states].count("FINAL") == 7
    assert [state for _, state in states].count("RUNNING") == 7
    assert not any(state in ("FAILED", "EXECUTION-FAILED") for _, state in states)


def test_the_robot_has_been_everywhere_and_is_at_the_last_waypoint(run):
    assert {f"visited {name}" for name in WAYPOINTS} <= {" ".join(fact) for fact in run.domain}
    assert [fact for fact in run.domain if fact[0] == "at"] == [("at", "tb3", "wp-final")]


def test_the_pose_passes_all_waypoints_in_order_and_within_the_limits(run):
    graph = load_navgraph(SCENARIO / "navgraph.yaml")
    left = [node for name in WAYPOINTS if (node := graph.node(name))]
    assert len(left) == 8
    for (before_us, (x0, y0, _), _), (time_us, (x, y, _), _) in zip(run.poses, run.poses[1:], strict=False):
        assert math.hypot(x - x0, y - y0) <= 0.22 * (time_us - before_us) / 1e6 + 1e-6
    for _, (x, y, _), _ in run.poses:
        if left and math.hypot(x - left[0].x, y - left[0].y) < 0.01:
            left.pop(0)
    assert left == []
    assert run.poses[-1][2] == (0.0, 0.0, pytest.approx(0.0, abs=1e-6), pytest.approx(1.0))


def test_the_command_exits_with_0(tmp_path):
    traces = [tmp_path / "a.mcap", tmp_path / "b.mcap"]
    for trace in traces:
        result = run_scenario(RunOptions(scenario=SCENARIO, trace=trace))
        assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
        assert 20 < result.run_seconds < 60
    runs = [open_run(trace) for trace in traces]
    assert compare_runs(runs[0], runs[1:], View.TRANSITIONS, Order.TOTAL).same
