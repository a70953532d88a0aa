"""The buffer of transforms: chains, times, and what it does not know."""

from __future__ import annotations

import math

import pytest

from cxbridge.space.tf import StampedTransform, Transform, TransformBuffer
from cxbridge.space.tf.errors import ExtrapolationError, NotConnectedError, UnknownFrameError
from cxbridge.space.tf.geometry import quaternion_from_yaw, quaternion_yaw

S = 1_000_000


def put(
    buffer: TransformBuffer, frame: str, child: str, x: float, at: float, yaw: float = 0.0, **more
) -> bool:
    transform = Transform((x, 0.0, 0.0), quaternion_from_yaw(yaw))
    return buffer.set_transform(StampedTransform(transform, round(at * S), frame, child), **more)


@pytest.fixture
def robot() -> TransformBuffer:
    """A robot that drives from x = 1 to x = 3, with a laser, and a gripper that points to the left."""
    buffer = TransformBuffer()
    put(buffer, "map", "base_link", 1.0, 10)
    put(buffer, "map", "base_link", 3.0, 12)
    put(buffer, "base_link", "laser", 0.5, 0, static=True)
    put(buffer, "base_link", "gripper", 0.25, 0, math.pi / 2, static=True)
    return buffer


def test_the_latest_is_asked_for_with_0(robot: TransformBuffer):
    found = robot.lookup("map", "laser")
    assert found.transform.translation == (3.5, 0.0, 0.0)
    assert (found.stamp_us, found.frame, found.child_frame) == (12 * S, "map", "laser")


def test_between_two_times_is_interpolated(robot: TransformBuffer):
    assert robot.lookup("map", "laser", 11 * S).transform.translation == pytest.approx((2.5, 0.0, 0.0))


def test_between_two_branches(robot: TransformBuffer):
    found = robot.lookup("gripper", "laser")
    assert found.transform.translation == pytest.approx((0.0, -0.25, 0.0))
    assert quaternion_yaw(found.transform.rotation) == pytest.approx(-math.pi / 2)
    assert found.stamp_us == 0  # both are static


def test_the_latest_common_time(robot: TransformBuffer):
    put(robot, "map", "other", 1.0, 11)
    assert robot.lookup("other", "base_link").transform.translation == pytest.approx((1.0, 0.0, 0.0))
    assert robot.lookup("other", "base_link").stamp_us == 11 * S


def test_later_than_the_last_is_the_last(robot: TransformBuffer):
    """As in Fawkes, not as in ROS."""
    assert robot.lookup("map", "base_link", 99 * S).transform.translation == (3.0, 0.0, 0.0)


def test_earlier_than_the_first_is_not_known(robot: TransformBuffer):
    with pytest.raises(ExtrapolationError, match="into the past"):
        robot.lookup("map", "base_link", 9 * S)
    assert not robot.can_transform("map", "laser", 9 * S)
    assert robot.can_transform("base_link", "laser", 9 * S)


def test_unknown_frames(robot: TransformBuffer):
    with pytest.raises(UnknownFrameError, match='Frame ID "moon" does not exist'):
        robot.lookup("map", "moon")
    assert not robot.can_transform("map", "moon")


def test_frames_of_two_trees(robot: TransformBuffer):
    put(robot, "world", "tree", 1.0, 10)
    for at in (0, 10 * S):
        with pytest.raises(NotConnectedError, match="'map' and 'tree'"):
            robot.lookup("map", "tree", at)


def test_a_loop_is_no_endless_loop():
    buffer = TransformBuffer()
    put(buffer, "a", "b", 1.0, 1)
    put(buffer, "b", "a", 1.0, 1)
    put(buffer, "c", "d", 1.0, 1)
    for at in (0, 1 * S):
        with pytest.raises(UnknownFrameError, match="loop"):
            buffer.lookup("d", "a", at)


def test_old_transforms_are_forgotten(robot: TransformBuffer):
    put(robot, "map", "base_link", 5.0, 21)
    with pytest.raises(ExtrapolationError):
        robot.lookup("map", "base_link", 10 * S)
    assert not put(robot, "map", "base_link", 0.0, 10.9)
    assert put(robot, "map", "base_link", 9.0, 11)  # out of order
    assert robot.lookup("map", "base_link", 11 * S).transform.translation == (9.0, 0.0, 0.0)
    assert robot.lookup("/map", "/base_link").transform.translation == (5.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("frame", "child", "x"), [("", "b", 1.0), ("a", "", 1.0), ("a", "a", 1.0), ("a", "b", math.nan)]
)
def test_nonsense_is_not_taken(frame: str, child: str, x: float):
    buffer = TransformBuffer()
    assert not put(buffer, frame, child, x, 1)
    assert buffer.frames == {}


def test_a_fixed_frame_in_between(robot: TransformBuffer):
    """Where was, two seconds ago, what the robot stands on, seen from where it is now?"""
    found = robot.lookup_via("base_link", 12 * S, "base_link", 10 * S, "map")
    assert found.transform.translation == pytest.approx((-2.0, 0.0, 0.0))
    assert found.stamp_us == 12 * S


def test_points_vectors_rotations_and_poses(robot: TransformBuffer):
    assert robot.transform_point("base_link", (1.0, 0.0, 0.0), "gripper")[0] == pytest.approx(
        (0.25, 1.0, 0.0)
    )
    assert robot.transform_vector("base_link", (1.0, 0.0, 0.0), "gripper")[0] == pytest.approx(
        (0.0, 1.0, 0.0)
    )
    rotation, _ = robot.transform_quaternion("base_link", quaternion_from_yaw(0.5), "gripper")
    assert quaternion_yaw(rotation) == pytest.approx(math.pi / 2 + 0.5)
    pose, at = robot.transform_pose("map", Transform((1.0, 0.0, 0.0)), "gripper")
    assert pose.translation == pytest.approx((3.25, 1.0, 0.0))
    assert at == 12 * S
