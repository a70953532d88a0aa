"""Unchanged skills of the RCLL agent with sub-skills and scripted hardware: their ends and errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.space.navgraph import NavGraph
from tests.skiller.lua.hardware import Frame, Gripper, Navigator, run, switches
from tests.skiller.lua.test_all_skill_files import load
from tests.skiller.rig import Rig
from tests.support import needs_robotino

pytestmark = needs_robotino


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    rig = load(tmp_path, [], "robotino", navgraph=NavGraph("field"))
    switches(rig, "motor-throttle", "laser-lines")
    Frame(rig, "map", "base_link").put(0.0, 0.0)
    for number, place in enumerate(["C-CS1", "C-CS2", "C-BS"]):
        Frame(rig, "map", place).put(number + 1.0, 0.5)
    return rig


def goals(navigator: Navigator) -> list[Any]:
    """Return the goals of the navigator."""
    return [
        order[1] if order[0].startswith("Place") else order[1:3]
        for order in navigator.orders
        if "Goto" in order[0]
    ]


# -- moveto and relmoveto: the base of the remaining skills


def test_moveto_arrives(rig: Rig):
    navigator = Navigator(rig)
    run(rig, 'moveto{place="C-CS2"}')
    assert (rig.status, rig.state.error) == ("S_FINAL", "")
    assert navigator.orders[0] == ("CartesianGotoWithFrameWithTolerance", 2.0, 0.5, 0.0, "map", 0.6, 3.14)


@pytest.mark.parametrize(
    ("skill", "error"),
    [
        ('moveto{place="C-CS1"}', "GOAL_OCCUPIED"),
        ("moveto{x=1, y=2}", "GOAL_OCCUPIED"),
        ('moveto{place="Mars"}', "no tf"),
    ],
)
def test_moveto_fails_with_error_of_navigator_or_frame(rig: Rig, skill: str, error: str):
    Navigator(rig, errors=(206,))
    run(rig, skill)
    assert (rig.status, rig.state.error) == ("S_FAILED", error)


# -- drive_into_field: moveto, which ends early when the robot is in the field


def set_pose(rig: Rig, y: float) -> None:
    pose: Any = rig.board.open_for_writing("Position3DInterface", "Pose", owner="test")
    pose.translation = (0.0, y, 0.0)
    pose.write()


def test_drive_into_field_waits_and_drives(rig: Rig):
    set_pose(rig, 0.0)
    navigator = Navigator(rig)
    loops = run(rig, 'drive_into_field{place="C-CS1", wait=1}')
    assert (rig.status, goals(navigator)) == ("S_FINAL", [(1.0, 0.5)])
    assert loops > 90  # a second of waiting, two of driving


# -- moveto_waypoints: repeated moveto


def test_moveto_waypoints_visits_all(rig: Rig):
    navigator = Navigator(rig)
    run(rig, 'moveto_waypoints{wp={"C-CS1", "C-BS", "C-CS2"}}')
    assert (rig.status, goals(navigator)) == ("S_FINAL", [(1.0, 0.5), (3.0, 0.5), (2.0, 0.5)])


# -- ppmoveto: the path planner, and moveto after its failure; ppmoveto_waypoints uses ppmoveto


def test_ppmoveto_follows_the_path_planner(rig: Rig):
    planner, navigator = Navigator(rig, "Pathplan"), Navigator(rig)
    run(rig, 'ppmoveto{place="C-CS1"}')
    assert (rig.status, goals(planner), navigator.orders) == ("S_FINAL", ["C-CS1"], [])


def test_ppmoveto_falls_back_to_moveto_without_path_planner(rig: Rig):
    """A path planner that takes no order for twenty loops counts as a failure."""
    planner, navigator = Navigator(rig, "Pathplan"), Navigator(rig)
    rig.backends.remove(planner)
    run(rig, 'ppmoveto{place="C-CS1"}')
    assert (rig.status, goals(navigator)) == ("S_FINAL", [(1.0, 0.5)])


# -- reset_gripper and discard: gripper_commands


def test_reset_gripper_goes_back_and_home(rig: Rig):
    gripper = Gripper(rig)
    rig.loop()
    run(rig, "reset_gripper{}")
    assert (rig.status, rig.state.error) == ("S_FINAL", "")
    assert gripper.orders == [
        ("MoveXYZAbs", 0.0, 0.0, 0.05, "end_effector_home"),
        ("MoveXYZAbs", 0.0, 0.0, 0.05, "end_effector_home"),
    ]


def test_reset_gripper_fails_without_frames(rig: Rig):
    """The skill does not expect missing frames: a Lua error in a state's init fails the skill."""
    run(rig, "reset_gripper{}")
    assert rig.status == "S_FAILED"
    assert rig.state.error.startswith("Init of successor failed: ")
    assert "attempt to index local 'gripper_rel' (a nil value)" in rig.state.error


def test_discard_opens_and_resets_gripper(rig: Rig):
    gripper = Gripper(rig)
    rig.loop()
    run(rig, "discard{}")
    assert (rig.status, rig.state.error) == ("S_FINAL", "")
    assert [order[0] for order in gripper.orders] == ["MoveXYZAbs", "OpenGripper", "MoveXYZAbs", "MoveXYZAbs"]
    assert gripper.orders[0][1] == 0.05


def test_gripper_commands_times_out(rig: Rig):
    """The frames are always older than the order: the skill fails after fifteen seconds."""
    arduino: Any = rig.board.open_for_writing("ArduinoInterface", "Arduino", owner="test")
    arduino.write()
    loops = run(rig, 'gripper_commands{command="OPEN"}')
    assert (rig.status, rig.state.error) == ("S_FAILED", "Timeout (15 sec)")
    assert 450 < loops < 470
