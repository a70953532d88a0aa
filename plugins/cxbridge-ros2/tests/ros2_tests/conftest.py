"""Peers of the tests: ours, and those of a real ROS 2 where ``ROS2_SETUP`` names its folder."""

from __future__ import annotations

import os
import shlex
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.forked import Forked, nursery

if TYPE_CHECKING:
    from cxbridge_ros2.node import Node

HERE = Path(__file__).parent
SETUP = os.environ.get("ROS2_SETUP", "")
OVERLAY = os.environ.get("ROS2_OVERLAY", "")
"""A folder with the ``setup.bash`` of more packages than that of ``ROS2_SETUP``, e.g. cx_msgs."""
needs_ros = pytest.mark.skipif(not SETUP, reason="ROS2_SETUP names no folder with the setup.bash of a ROS 2")


def _slot() -> int:
    """Return one of twelve numbers: no two workers of a run have the same, nor have most runs."""
    worker, run = (os.environ.get(f"PYTEST_XDIST_{each}") for each in ("WORKER", "TESTRUNUID"))
    if worker is None or run is None:
        return os.getpid() % 12
    return int(worker.removeprefix("gw")) % 4 + int(run[:8], 16) % 3 * 4


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    """Set a DDS domain of this process' own, and keep discovery on this host.

    The 17 domains after it are this process', too: ``domain + 3``.
    """
    number = 1 + _slot() * 18  # the ports of DDS suffice for 232 domains
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(number))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        patch.delenv("CYCLONEDDS_URI", raising=False)
        yield number


@pytest.fixture(autouse=True, scope="session")
def qos_is_read_by_one_thread() -> Iterator[None]:
    """Let each Qos that a thread reads without READ_QOS fail: cyclonedds reads them into shared buffers."""
    with suppress(ImportError), pytest.MonkeyPatch.context() as patch:
        from cyclonedds.qos import _CQos

        from cxbridge_ros2.transports.dds.domain import QOS_LOCK

        read = _CQos.cqos_to_qos

        def checked(pointer: object) -> object:
            assert QOS_LOCK.locked(), "a Qos is read without READ_QOS"
            return read(pointer)

        patch.setattr(_CQos, "cqos_to_qos", checked)
        yield
        return
    yield


HUBS = os.environ.get("ROS2_HUBS", "")
"""The folder that with_rclcpp was built in."""


@cache
def find_package(name: str) -> Path | None:
    """Return the prefix of a package of the ROS, if the ROS has the package."""
    command = in_ros("printenv", "AMENT_PREFIX_PATH")
    result = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True) if SETUP else None
    prefixes = map(Path, result.stdout.strip().split(os.pathsep) if result else ())
    return next((prefix for prefix in prefixes if (prefix / "share" / name).is_dir()), None)


def in_ros(*command: str) -> list[str]:
    """Return a command that runs a program in the environment of ROS."""
    script = f"source {shlex.quote(OVERLAY or SETUP)}/setup.bash && exec {shlex.join(command)}"
    rmw = os.environ.get("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")
    return ["env", f"RMW_IMPLEMENTATION={rmw}", "bash", "-c", script]


def with_ros(*command: str) -> list[str]:
    """Return a command with which the Python of ROS (``ROS2_PYTHON``) runs a script of this folder."""
    return in_ros(os.environ.get("ROS2_PYTHON", "python3"), *command)


@contextmanager
def forked(module: str, *arguments: str) -> Iterator[Forked]:
    """Run ``main`` of a module as a process; it is ready."""
    made = nursery().begin(arguments, program=module)
    with made.process, made.stdin, made.stdout, made.stderr:
        assert made.stdout.readline() == b"ready\n", made.stderr.read().decode()
        try:
            yield made.process
        finally:
            made.process.kill()
            made.process.wait(60)


@contextmanager
def started(kind: str, script: str, *arguments: str) -> Iterator[None]:
    """Run a script of rclpy, or the module of that name of ours."""
    if kind == "ours":
        with forked(f"ros2_tests.{Path(script).stem}", *arguments):
            yield
    else:
        process = start(kind, script, *arguments)
        yield
        stop(process)


def start(kind: str, script: str, *arguments: str) -> subprocess.Popen[str]:
    """Start a script of rclpy or a program of rclcpp; it is ready."""
    if kind == "rclcpp":
        command = in_ros(str(Path(HUBS) / script), *arguments)
    else:
        command = with_ros(str(HERE / "with_rclpy" / script), *arguments)
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=HERE.parent.parent
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


def stop(process: subprocess.Popen[str]) -> None:
    """Kill a peer."""
    process.kill()
    process.communicate()


def free_port() -> int:
    """Return a TCP port of this host that is free."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def wait_for_port(port: int) -> None:
    """Wait for a listener."""

    def is_open() -> bool:
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", port)) == 0

    until(is_open, lambda: time.sleep(0.1))


def until(done: Callable[[], Any], *polls: Callable[[], object], limit_s: float = 45.0) -> None:
    """Poll until a condition is true."""
    end_s = time.monotonic() + limit_s
    while not done():
        assert time.monotonic() < end_s, "it took too long"
        for poll in polls:
            poll()


def poll_until(node: Node, done: Callable[[], Any], limit_s: float = 45.0) -> None:
    """Poll a node until a condition is true."""
    until(done, lambda: node.poll(0.05), limit_s=limit_s)


@pytest.fixture(scope="module", params=["ours", pytest.param("rclpy", marks=needs_ros)])
def peer(request: pytest.FixtureRequest, domain: int) -> Iterator[str]:
    """A node that echoes /there to /back, adds, and counts; its kind."""
    pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
    with started(request.param, "peer.py"):
        yield request.param
