"""Frames of ROS 2 in a run, from a node of cxbridge and from rclpy."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.events import LogLine
from cxbridge.run.agent import Run
from cxbridge.run.options import RunOptions
from cxbridge.space.tf import (
    StampedTransform,
    Transform,
    TransformBuffer,
    TransformListener,
    TransformPublisher,
)
from cxbridge_ros2.components import transforms
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.transports.dds import DdsNode
from ros2_tests.conftest import HERE, make_ros_python_command, needs_ros, wait_until
from tests.run.mini import write_scenario

Poll = Callable[[], object]


@pytest.fixture
def send_frames(domain: int) -> Iterator[Poll]:
    """Return a function that publishes the transforms of with_rclpy/transforms.py."""
    with DdsNode("sends", Definitions(environment={}), domain + 3) as node:
        static, moving = (
            node.create_publisher(topic, "tf2_msgs/msg/TFMessage", PROFILES[topic[1:]])
            for topic in ("/tf_static", "/tf")
        )
        static.publish({"transforms": [make_transform("base_link", "gripper", 0.5)]})
        yield lambda: moving.publish(
            {"transforms": [make_transform("map", "base_link", 2.0), make_transform("map", "/other", 1.0)]}
        )


def make_transform(frame: str, child: str, x: float) -> dict[str, Any]:
    now = time.time_ns()
    stamp = {"sec": now // 10**9, "nanosec": now % 10**9}
    offset = {
        "translation": {"x": x, "y": 0.0, "z": 0.0},
        "rotation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    }
    return {"header": {"stamp": stamp, "frame_id": frame}, "child_frame_id": child, "transform": offset}


def make_run(folder: Path, domain: int, settings: str = "frames: all") -> Run:
    scenario = write_scenario(folder / "mini")
    more = folder / "more.yaml"
    more.write_text(f"ros2: {{tf: {{domain: {domain}, {settings}}}}}\n")
    return Run(RunOptions(scenario=scenario, config=(more,), clock="real", skiller="none"))


@pytest.fixture
def buffer(tmp_path: Path, domain: int) -> Iterator[tuple[Run, TransformBuffer]]:
    with make_run(tmp_path, domain + 3) as run:
        run.start()
        frames = TransformBuffer()
        listener = TransformListener(run.board, frames)
        yield run, frames
        listener.close()


def test_run_has_static_and_moving_frames(buffer, send_frames: Poll):
    run, frames = buffer
    wait_until(lambda: frames.can_transform("map", "gripper"), send_frames, run.loop.run_once)
    assert frames.lookup("map", "gripper").transform.translation == (2.5, 0.0, 0.0)
    assert frames.lookup("map", "other").transform.translation == (1.0, 0.0, 0.0)


@needs_ros
def test_run_has_frames_of_rclpy(buffer, domain: int, monkeypatch: pytest.MonkeyPatch):
    run, frames = buffer
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain + 3))
    command = make_ros_python_command(str(HERE / "with_rclpy/transforms.py"))
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        wait_until(lambda: frames.can_transform("map", "gripper"), run.loop.run_once)
    finally:
        process.kill()
        process.communicate()
    assert frames.lookup("map", "gripper").transform.translation == (2.5, 0.0, 0.0)


def test_frames_of_run_are_published(tmp_path: Path, domain: int, send_frames: Poll):
    got: dict[str, list[Any]] = {"/tf": [], "/tf_static": []}
    with (
        DdsNode("hears", Definitions(environment={}), domain + 3) as node,
        make_run(tmp_path, domain + 3, "publish: true") as run,
    ):
        for topic, messages in got.items():
            node.subscribe(topic, "tf2_msgs/msg/TFMessage", messages.append, PROFILES[topic[1:]])
        run.start()
        hand, camera = (TransformPublisher(run.board, name) for name in ("hand", "camera"))
        position = Transform((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))
        camera.send(StampedTransform(position, 1_000_000, "base_link", "camera"), static=True)

        def children(topic: str) -> set[str]:
            return {each["child_frame_id"] for message in got[topic] for each in message["transforms"]}

        def has_all_frames() -> bool:
            hand.send(StampedTransform(position, run.clock.now_us(), "base_link", "hand"))
            node.poll()
            return "hand" in children("/tf") and "camera" in children("/tf_static")

        wait_until(has_all_frames, send_frames, run.loop.run_once)
        (received,) = (each for each in got["/tf"][-1]["transforms"])
        moving = [each for each in got["/tf"] if len(each["transforms"]) == 1]
        assert {each["transforms"][0]["child_frame_id"] for each in moving} == {"hand"}
        assert received["transform"]["translation"] == {"x": 1.0, "y": 2.0, "z": 3.0}
        hand.close()
        camera.close()


def test_unselected_frames_are_ignored(tmp_path: Path, domain: int, send_frames: Poll):
    with make_run(tmp_path, domain + 3, "frames: [base_link]") as run:
        run.start()
        frames = TransformBuffer()
        with closing(TransformListener(run.board, frames)):
            wait_until(lambda: frames.frame_exists("base_link"), send_frames, run.loop.run_once)
            run.loop.run_once()
        assert not frames.frame_exists("other")


def test_frames_beyond_limit_are_reported(buffer, send_frames: Poll, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(transforms, "MAX_FRAMES", 2)
    run, _frames = buffer
    lines: list[str] = []
    run.bus.subscribe(lambda event: lines.append(event.text), LogLine)
    report = "is ignored: the limit of 2 frames is reached"
    wait_until(lambda: any(report in line for line in lines), send_frames, run.loop.run_once)
