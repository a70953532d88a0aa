"""The feature `tf` as rules see it."""

from __future__ import annotations

import math

import pytest

from cxbridge.events import Level
from cxbridge.executive.features.tf import TfFeature
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.space.tf import StampedTransform, Transform, TransformPublisher
from cxbridge.space.tf.geometry import quaternion_from_yaw

NO = ("FALSE",)
LATEST = (0, 0)
QUARTER = quaternion_from_yaw(math.pi / 2)


@pytest.fixture
def tf(bus, board, log):
    manager = EnvironmentManager(bus, [TfFeature(board)])
    env = manager.create("executive")
    assert manager.request("executive", "tf") == "TRUE"
    yield env
    manager.close()
    assert not [info for info in board.list_all() if info.type == "TransformInterface"]


@pytest.fixture
def robot(tf, board):
    """The robot's frame lies at (1, 2) in the map, turned left by a quarter."""
    publisher = TransformPublisher(board, "robot")
    publisher.send(StampedTransform(Transform((1.0, 2.0, 0.0), QUARTER), 5_000_000, "map", "robot"))
    yield tf
    publisher.close()


def near(got, expected):
    return got == pytest.approx(expected, abs=1e-12)


def test_angles(tf):
    assert near(tf.call("tf-quat-from-yaw", 0), (0, 0, 0, 1))
    assert near(tf.call("tf-quat-from-yaw", math.pi / 2), QUARTER)
    assert tf.call("tf-yaw-from-quat", QUARTER) == pytest.approx(math.pi / 2)
    assert tf.call("tf-yaw-from-quat", (0, 0, 0, 1)) == 0.0


def test_frames(robot):
    assert robot.call("tf-frame-exists", "robot") == "TRUE"
    assert robot.call("tf-frame-exists", "moon") == "FALSE"
    assert robot.call("tf-can-transform", "map", "robot", LATEST) == "TRUE"
    assert robot.call("tf-can-transform", "map", "robot", (5, 0)) == "TRUE"
    assert robot.call("tf-can-transform", "map", "robot", (4, 999_999)) == "FALSE"
    assert robot.call("tf-can-transform", "map", "moon", LATEST) == "FALSE"


def test_transforms(robot):
    ways = ("map", "robot", LATEST)
    assert near(robot.call("tf-transform-point", *ways, (1, 0, 0)), (1, 3, 0))
    assert near(robot.call("tf-transform-vector", *ways, (1.0, 0, 0.5)), (0, 1, 0.5))
    assert near(robot.call("tf-transform-quaternion", *ways, (0, 0, 0, 1)), QUARTER)
    pose = robot.call("tf-transform-pose", *ways, (1, 0, 0), (0, 0, 0, 1))
    assert near(pose, (1, 3, 0, *QUARTER))
    back = robot.call("tf-transform-pose", "robot", "map", LATEST, pose[:3], pose[3:])
    assert near(back, (1, 0, 0, 0, 0, 0, 1))


@pytest.mark.parametrize(
    ("function", "values"),
    [
        ("point", [(1, 0, 0)]),
        ("vector", [(1, 0, 0)]),
        ("quaternion", [(0, 0, 0, 1)]),
        ("pose", [(1, 0, 0), (0, 0, 0, 1)]),
    ],
)
def test_invalid_transforms_return_false(robot, log, function, values):
    name = f"tf-transform-{function}"
    assert robot.call(name, "map", "moon", LATEST, *values) == NO
    assert robot.call(name, "map", "robot", (1, 2, 3), *values) == NO
    assert robot.call(name, "map", "robot", (1, 2.5), *values) == NO
    short = [value[:-1] for value in values]
    assert robot.call(name, "map", "robot", LATEST, *short) == NO
    texts = [tuple("x" for _ in value) for value in values]
    assert robot.call(name, "map", "robot", LATEST, *texts) == NO
    warnings = log.texts(Level.WARN)
    assert warnings[0].startswith(f"Failed to transform {function} from moon to map: ")
    assert warnings[1] == "Invalid time: must be list of exactly two entries"
    assert warnings[2] == "Invalid time: must be list of integers"
    assert "must be list of exactly" in warnings[3]
    assert "must be list of floats or integers" in warnings[-1]


def test_invalid_rotation_returns_false(robot, log):
    assert robot.call("tf-transform-pose", "map", "robot", LATEST, (0, 0, 0), (1, 1, 1, 1)) == NO
    assert "Quaternion malformed" in log.texts(Level.WARN)[0]


@pytest.mark.parametrize("function", ["tf-publish-pose", "tf-publish-pose-static"])
def test_publishing(tf, function):
    assert tf.call(function, "map", "box", 0.0, 1.0, 2.0) == NO
    assert tf.call("tf-add-publisher", "box") == ("TRUE",)
    assert tf.call("tf-add-publisher", "box") == NO
    assert tf.call(function, "map", "box", math.pi / 2, 1, 2.0) == ("TRUE",)
    assert near(tf.call("tf-transform-point", "map", "box", LATEST, (0, 0, 0)), (1, 2, 0))
    static = function.endswith("static")
    assert tf.call("tf-can-transform", "map", "box", (1, 0)) == ("TRUE" if static else "FALSE")


def test_frame_of_another_publisher_is_refused(tf, board, log):
    other = TransformPublisher(board, "box")
    assert tf.call("tf-add-publisher", "box") == NO
    assert "box" in log.texts(Level.WARN)[-1]
    other.close()
