"""Peers of the tests: nodes of cxbridge, and nodes of the real ROS 2 in the folder ``ROS2_SETUP``."""

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
"""A folder whose ``setup.bash`` adds packages to those of ``ROS2_SETUP``, e.g. cx_msgs."""
needs_ros = pytest.mark.skipif(not SETUP, reason="ROS2_SETUP names no folder with the setup.bash of a ROS 2")


def _slot() -> int:
    """Return one of twelve numbers: each worker of a run and most runs have different numbers."""
    worker, run = (os.environ.get(f"PYTEST_XDIST_{each}") for each in ("WORKER", "TESTRUNUID"))
    if worker is None or run is None:
        return os.getpid() % 12
    return int(worker.removeprefix("gw")) % 4 + int(run[:8], 16) % 3 * 4


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    """Set a DDS domain for this process alone, and limit discovery to this host.

    This process may use the next 17 domains, too: ``domain + 3``.
    """
    number = 1 + _slot() * 18  # the ports of DDS suffice for 232 domains
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(number))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        patch.delenv("CYCLONEDDS_URI", raising=False)
        yield number


@pytest.fixture(autouse=True, scope="session")
def check_qos_reads() -> Iterator[None]:
    """Fail if a thread reads a Qos without READ_QOS: cyclonedds reads every Qos into shared buffers."""
    with suppress(ImportError), pytest.MonkeyPatch.context() as patch:
        from cyclonedds.qos import _CQos

        from cxbridge_ros2.transports.dds.domain import QOS_LOCK

        read = _CQos.cqos_to_qos

        def read_with_check(pointer: object) -> object:
            assert QOS_LOCK.locked(), "a Qos is read without READ_QOS"
            return read(pointer)

        patch.setattr(_CQos, "cqos_to_qos", read_with_check)
        yield
        return
    yield


HUBS = os.environ.get("ROS2_HUBS", "")
"""The build folder of with_rclcpp."""


@cache
def find_package(name: str) -> Path | None:
    """Return the prefix of a package of the ROS, if the ROS has the package."""
    command = make_ros_command("printenv", "AMENT_PREFIX_PATH")
    result = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True) if SETUP else None
    prefixes = map(Path, result.stdout.strip().split(os.pathsep) if result else ())
    return next((prefix for prefix in prefixes if (prefix / "share" / name).is_dir()), None)


def make_ros_command(*command: str) -> list[str]:
    """Return a command that runs a program in the environment of ROS."""
    script = f"source {shlex.quote(OVERLAY or SETUP)}/setup.bash && exec {shlex.join(command)}"
    rmw = os.environ.get("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")
    return ["env", f"RMW_IMPLEMENTATION={rmw}", "bash", "-c", script]


def make_ros_python_command(*command: str) -> list[str]:
    """Return a command with which the Python of ROS (``ROS2_PYTHON``) runs a script of this folder."""
    return make_ros_command(os.environ.get("ROS2_PYTHON", "python3"), *command)


@contextmanager
def run_module(module: str, *arguments: str) -> Iterator[Forked]:
    """Run ``main`` of a module as a process, and wait until the process is ready."""
    forked = nursery().begin(arguments, program=module)
    with forked.process, forked.stdin, forked.stdout, forked.stderr:
        assert forked.stdout.readline() == b"ready\n", forked.stderr.read().decode()
        try:
            yield forked.process
        finally:
            forked.process.kill()
            forked.process.wait(60)


@contextmanager
def run_peer(kind: str, script: str, *arguments: str) -> Iterator[None]:
    """Run a script of rclpy, or the module of the same name in this folder."""
    if kind == "ours":
        with run_module(f"ros2_tests.{Path(script).stem}", *arguments):
            yield
    else:
        process = start_peer(kind, script, *arguments)
        yield
        kill_peer(process)


def start_peer(kind: str, script: str, *arguments: str) -> subprocess.Popen[str]:
    """Start a script of rclpy or a program of rclcpp, and wait until the process is ready."""
    if kind == "rclcpp":
        command = make_ros_command(str(Path(HUBS) / script), *arguments)
    else:
        command = make_ros_python_command(str(HERE / "with_rclpy" / script), *arguments)
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=HERE.parent.parent
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


def kill_peer(process: subprocess.Popen[str]) -> None:
    """Kill the process of a peer."""
    process.kill()
    process.communicate()


def free_port() -> int:
    """Return a free TCP port of this host."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for_port(port: int) -> None:
    """Wait until a process listens on a port."""

    def is_open() -> bool:
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", port)) == 0

    wait_until(is_open, lambda: time.sleep(0.1))


def wait_until(condition: Callable[[], Any], *polls: Callable[[], object], limit_s: float = 45.0) -> None:
    """Poll until a condition is true."""
    end_s = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end_s, "the condition stayed false for too long"
        for poll in polls:
            poll()


def poll_until(node: Node, condition: Callable[[], Any], limit_s: float = 45.0) -> None:
    """Poll a node until a condition is true."""
    wait_until(condition, lambda: node.poll(0.05), limit_s=limit_s)


@pytest.fixture(scope="module", params=["ours", pytest.param("rclpy", marks=needs_ros)])
def peer(request: pytest.FixtureRequest, domain: int) -> Iterator[str]:
    """Run a node with an echo of /there on /back, a service and an action; return the kind of node."""
    pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
    with run_peer(request.param, "peer.py"):
        yield request.param
