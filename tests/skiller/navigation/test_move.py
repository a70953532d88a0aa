"""The executor of a simulated robot base, on a virtual clock."""

from __future__ import annotations

import itertools
import math

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.skiller.board import ExecutorContext
from cxbridge.skiller.board.host import ExecutorHost
from cxbridge.skiller.board.protocol import MasterState
from cxbridge.skiller.navigation import Move
from tests.skiller.board.rig import PERIOD_US, Rig, call

GRAPH = """
graph-name: test
nodes:
  - {name: a, pos: [0.0, 0.0]}
  - {name: b, pos: [1.0, 0.0]}
  - {name: c, pos: [1.0, 1.0], properties: [{orientation: 0.0}]}
  - !unconnected {name: island, pos: [9.0, 9.0]}
connections:
  - [a, b]
  - [b, c]
"""


@pytest.fixture
def rig(tmp_path):
    (tmp_path / "graph.yaml").write_text(GRAPH)
    rig = Rig()
    yield rig
    rig.close()


def add_robot(rig, folder, **settings):
    context = ExecutorContext(
        "r1", rig.board, rig.clock, rig.bus.logger("r1"), {"navgraph": "graph.yaml", **settings}, folder
    )
    rig.hosts.append(ExecutorHost(Move(context), "r1-move"))
    return rig.board.open_for_reading("Position3DInterface", settings.get("pose", "Pose-r1"), owner="test")


def pose_of(pose):
    pose.read()
    x, y, _ = pose.translation
    return x, y, 2 * math.atan2(pose.rotation[2], pose.rotation[3])


def test_robot_drives_along_graph_with_limited_speed(rig, tmp_path):
    skills, pose = rig.skills(), add_robot(rig, tmp_path, speed=0.5, turn=1.0)
    assert pose_of(pose) == (0.0, 0.0, 0.0)
    begin_us, way = rig.clock.now_us(), [pose_of(pose)]
    master = skills.request(call(to="c"))
    progress = []
    while not master.is_over:
        rig.loop()
        way.append(pose_of(pose))
        progress.append(master.progress)
    assert master.state is MasterState.SUCCEEDED
    assert way[-1] == (1.0, 1.0, pytest.approx(0.0))
    # two metres at 0.5 m/s, and two right angles at 1 rad/s
    assert (rig.clock.now_us() - begin_us) / 1e6 == pytest.approx(4.0 + math.pi, abs=0.2)
    for (x0, y0, yaw0), (x, y, yaw) in itertools.pairwise(way):
        assert math.hypot(x - x0, y - y0) <= 0.5 * PERIOD_US / 1e6 + 1e-9
        assert abs(yaw - yaw0) <= 1.0 * PERIOD_US / 1e6 + 1e-9
    assert any(x == pytest.approx(1.0) and y == pytest.approx(0.0) for x, y, _ in way)
    assert progress == sorted(progress)


def test_goto_drives_to_place(rig, tmp_path):
    skills, pose = rig.skills(), add_robot(rig, tmp_path, speed=5)
    master = skills.request(call("goto", place="b"))
    rig.until(lambda: master.is_over)
    assert pose_of(pose)[:2] == (1.0, 0.0)


@pytest.mark.parametrize(
    ("parameters", "error"),
    [
        ({}, "move needs the parameter 'to'"),
        ({"to": 3}, "move: the parameter 'to' must be a string, not 3"),
        ({"to": "nowhere"}, "there is no place 'nowhere'"),
        ({"to": "island"}, "there is no path to island"),
    ],
)
def test_unreachable_places_fail(rig, tmp_path, parameters, error):
    skills = rig.skills()
    add_robot(rig, tmp_path)
    master = skills.request(call(**parameters))
    rig.until(lambda: master.is_over)
    assert (str(master.state), master.error) == ("FAILED", error)


@pytest.mark.parametrize(
    ("settings", "error"),
    [
        ({"speed": 0.0}, "speed must be above 0"),
        ({"turn": -1.0}, "turn must be above 0"),
        ({"speed": "fast"}, "needs a float as 'speed'"),
        ({"start": "nowhere"}, "there is no place 'nowhere'"),
        ({"navgraph": "none.yaml"}, "cannot read"),
        ({"sped": 1.0}, "has no setting 'sped'"),
    ],
)
def test_invalid_settings_are_refused(rig, tmp_path, settings, error):
    with pytest.raises(CxbridgeError, match=error):
        add_robot(rig, tmp_path, **settings)
    assert rig.board.list_all() == []
