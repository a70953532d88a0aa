"""How long driving takes, and where the robot is meanwhile."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.config import Configuration
from cxbridge.skiller.simulation.deciders import Outcome
from cxbridge.skiller.simulation.estimators import EstimatorProperty, EstimatorSettings, SkillPattern
from cxbridge.skiller.simulation.make import make_simulator
from cxbridge.skiller.simulation.navigation import NavGraphEstimator
from cxbridge.skiller.skillstring import parse_skill_call
from cxbridge.space.navgraph import NavGraph
from cxbridge.space.navgraph.graph import NavGraphEdge, NavGraphNode
from tests.skiller.rig import Rig
from tests.support import ROOT


@pytest.fixture
def graph() -> NavGraph:
    """A -3 m- B -4 m- C, and an island."""
    made = NavGraph("test")
    for name, x, y in (("A", 0.0, 0.0), ("B", 3.0, 0.0), ("C", 3.0, 4.0), ("island", 99.0, 0.0)):
        made.add_node(NavGraphNode(name, x, y))
    made.add_edge(NavGraphEdge("A", "B"))
    made.add_edge(NavGraphEdge("B", "C"))
    return made


def seconds(estimator: NavGraphEstimator, text: str) -> float | None:
    outcome = estimator.decide(parse_skill_call(text))
    assert outcome is None or outcome == Outcome(outcome.seconds)
    return None if outcome is None else outcome.seconds


def test_the_length_of_the_way_by_the_speed(graph: NavGraph):
    estimator = NavGraphEstimator(graph, EstimatorSettings(speed=0.5))
    assert seconds(estimator, 'goto{place="C"}') == 14.0
    assert seconds(estimator, 'goto{place="A"}') == 0.0


@pytest.mark.parametrize("text", ['goto{place="nowhere"}', 'goto{to="C"}', 'goto{place="island"}', "goto{}"])
def test_what_is_no_node_that_can_be_reached_is_for_others(graph: NavGraph, text: str):
    assert seconds(NavGraphEstimator(graph), text) is None


def test_start_and_target_are_arguments_by_the_entry_of_the_whitelist(graph: NavGraph):
    chosen = EstimatorSettings(whitelist=[SkillPattern("drive", key="d"), SkillPattern("goto", key="g")])
    estimator = NavGraphEstimator(
        graph,
        chosen,
        target=EstimatorProperty("place", {"d": "to"}),
        start=EstimatorProperty("", {"d": "from"}),
    )
    assert seconds(estimator, 'drive{from="B", to="C"}') == 4.0
    assert seconds(estimator, 'drive{to="C"}') == 7.0
    assert seconds(estimator, 'goto{place="C", from="B"}') == 7.0
    assert seconds(estimator, 'walk{place="C"}') is None


def test_without_a_start_it_is_the_closest_node_to_the_pose(graph: NavGraph):
    estimator = NavGraphEstimator(graph, pose=(2.5, 3.0))
    assert seconds(estimator, 'goto{place="A"}') == 7.0


def test_the_pose_moves_along_the_way(graph: NavGraph):
    estimator = NavGraphEstimator(graph, EstimatorSettings(speed=2.0))
    call = parse_skill_call('goto{place="C"}')
    estimator.decide(call)
    poses = []
    for now in (0.0, 1.0, 1.5, 2.5, 3.5):
        estimator.progress(call, now)
        poses.append(estimator.pose)
    quarter = math.pi / 2
    assert poses == [(0, 0, 0), (2, 0, 0), (3, 0, quarter), (3, 2, quarter), (3, 4, quarter)]
    estimator.progress(parse_skill_call("say{}"), 0.0)  # of another skill, at the same time
    assert estimator.pose == poses[-1]


CONFIG = """
plugins/amcl: {init_pose_x: 3.0, init_pose_y: 0.1, pose_interface_id: Here}
frames/fixed: /map
plugins/execution-time-estimator/navgraph: {speed: 2.0}
"""


def test_the_simulator_tells_the_pose_and_a_stopped_robot_stays_there(graph: NavGraph):
    rig = Rig()
    config = Configuration.from_text(CONFIG)
    simulator = make_simulator(rig.board, rig.clock, rig.bus, config=config, navgraph=graph)
    rig.add(simulator)
    pose: Any = rig.board.open_for_reading("Position3DInterface", "Here", owner="test")
    pose.read()
    assert (pose.frame, pose.translation) == ("/map", (3.0, 0.1, 0.0))
    rig.exec('goto{place="C"}', loops=31)
    rig.send("StopExec")
    rig.loop()
    pose.read()
    assert pose.translation == pytest.approx((3.0, 2.0, 0.0), abs=0.1)
    assert pose.rotation == pytest.approx((0, 0, math.sqrt(0.5), math.sqrt(0.5)))
    rig.loop(9)
    before = pose.translation
    pose.read()
    assert pose.translation == before
    rig.exec('goto{place="C"}', loops=100)
    pose.read()
    assert (pose.translation, rig.status) == ((3.0, 4.0, 0.0), "S_FINAL")
    simulator.close()
    assert not pose.has_writer


def test_a_pose_that_somebody_else_writes_is_an_error_unless_it_is_left_alone(graph: NavGraph):
    rig = Rig()
    with rig.board.open_for_writing("Position3DInterface", "Here", owner="amcl"):
        config = Configuration.from_text(CONFIG)
        with pytest.raises(BlackBoardError):
            make_simulator(rig.board, rig.clock, rig.bus, config=config, navgraph=graph)
        config.set("/plugins/execution-time-estimator/navgraph/pose-update", value=False)
        make_simulator(rig.board, rig.clock, rig.bus, config=config, navgraph=graph).close()


def test_the_example_of_the_documentation(graph: NavGraph, tmp_path: Path):
    page = (ROOT / "docs" / "skiller.md").read_text()
    example = page.partition("## The simulator")[2].partition("```yaml\n")[2].partition("```")[0]
    config = Configuration.from_text(example)
    rig = Rig()
    rig.add(make_simulator(rig.board, rig.clock, rig.bus, config=config, navgraph=graph))
    rig.exec('drive{from="B", to="C"}')
    assert any("will take 8.00 seconds" in event.text for event in rig.events if hasattr(event, "text"))
