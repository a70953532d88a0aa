"""Poses of the places of skills."""

from __future__ import annotations

import math

import pytest

from cxbridge_rcll.field import Field, Pose, entry_pose

MACHINES = [
    {"name": "C-BS", "zone": "C_Z47", "rotation": 90},
    {"name": "M-RS1", "zone": "M_Z12", "rotation": 0},
    {"name": "C-DS", "zone": "TBD", "rotation": -1},
]


@pytest.mark.parametrize(
    ("place", "x", "y"),
    [
        ("C-Z48", 3.5, 7.5),
        ("M_Z11", -0.5, 0.5),
        ("C-BS-INPUT", 3.5, 7.25),
        ("C-BS-OUTPUT", 3.5, 5.75),
        ("C-BS-O", 3.5, 5.75),
        ("WAIT-C-BS-I", 3.5, 8.0),
        ("M-RS1-INPUT", 0.25, 1.5),
    ],
)
def test_place_has_pose(place, x, y):
    pose = Field(lambda: MACHINES).find_pose(place)
    assert pose is not None
    assert (pose.x, pose.y) == pytest.approx((x, y))


@pytest.mark.parametrize("place", ["", "START", "C-CS1-INPUT", "C-DS-INPUT"])
def test_unknown_place_has_no_pose(place):
    assert Field(lambda: MACHINES).find_pose(place) is None


def test_robot_at_machine_faces_machine():
    pose = Field(lambda: MACHINES).find_pose("C-BS-INPUT")
    assert pose is not None
    assert math.sin(pose.yaw) == pytest.approx(-1)


def test_poses_have_distances_and_entries_differ():
    assert Pose(0, 0).distance_m(Pose(3, 4)) == 5
    assert len({entry_pose(number) for number in (1, 2, 3)}) == 3
