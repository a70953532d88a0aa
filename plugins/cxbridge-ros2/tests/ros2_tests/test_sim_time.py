"""Simulated time of a run, from a node of cxbridge and from rclpy."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.clock import MICROSECONDS
from cxbridge.closing import Closing
from cxbridge.errors import Ros2Error
from cxbridge.events import GoalTransition
from cxbridge.trace.formats.registry import open_run
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.sim_time import SimTimeClock
from cxbridge_ros2.transports.dds import DdsNode
from ros2_tests.conftest import HERE, make_ros_python_command, needs_ros
from tests.run.mini import write_scenario

START_S = 100
STEP_S = 0.01


class Simulation(Closing):
    """A simulation that publishes the time except during pauses."""

    def __init__(self, domain: int, speed: float = 1.0) -> None:
        self._node = DdsNode("simulation", Definitions(environment={}), domain)
        self._topic = self._node.create_publisher("/clock", "rosgraph_msgs/msg/Clock", PROFILES["clock"])
        self._pause_s = STEP_S / speed
        self.now_ms = START_S * 1000
        self.is_running, self._ended = threading.Event(), threading.Event()
        self.is_running.set()
        self._thread = threading.Thread(target=self._send)
        self._thread.start()

    def _send(self) -> None:
        while not self._ended.wait(self._pause_s):
            if self.is_running.is_set():
                self.now_ms += round(STEP_S * 1000)
            seconds, rest = divmod(self.now_ms, 1000)
            self._topic.publish({"clock": {"sec": seconds, "nanosec": rest * 10**6}})

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self._node.close()


@pytest.fixture
def simulation(domain: int) -> Iterator[Simulation]:
    with Simulation(domain + 9, speed=5) as instance:
        yield instance


@pytest.fixture
def clock(domain: int) -> Iterator[SimTimeClock]:
    with closing(make_clock(domain)) as instance:
        yield instance


def make_clock(domain: int, timeout_s: float = 20) -> SimTimeClock:
    return SimTimeClock(lambda: DdsNode("follows", Definitions(environment={}), domain + 9), timeout_s)


def test_clock_stands_still_during_pause_of_simulation(simulation: Simulation, clock: SimTimeClock):
    clock.now_us()
    simulation.is_running.clear()
    clock.sleep_until(simulation.now_ms * 1000)
    paused_us = clock.now_us()
    woken = threading.Event()
    threading.Timer(0.3, woken.set).start()
    clock.sleep_until(paused_us + 1, woken)
    assert woken.is_set()
    assert clock.now_us() == paused_us
    simulation.is_running.set()
    clock.sleep_until(paused_us + 1)
    assert clock.now_us() > paused_us


def test_clock_continues_after_reset_of_simulation(simulation: Simulation, clock: SimTimeClock):
    clock.sleep_until(clock.now_us() + 500_000)
    before_us = clock.now_us()
    simulation.now_ms = 10
    clock.sleep_until(before_us + 100_000)
    assert clock._offset_us > 0
    assert clock.now_us() < before_us + 10 * MICROSECONDS


def test_missing_simulation_is_reported_with_hint(domain: int):
    with pytest.raises(Ros2Error, match=r"no time was received on /clock within 0\.2 s") as caught:
        make_clock(domain + 1, 0.2).now_us()
    assert caught.value.hint == (
        "is the simulation running, and is it in the same ROS_DOMAIN_ID and range of discovery?"
    )


@contextmanager
def run_simulation(kind: str, domain: int) -> Iterator[None]:
    """Run a simulation at five times real time."""
    if kind == "ours":
        with Simulation(domain, speed=5):
            yield
        return
    command = make_ros_python_command(str(HERE / "with_rclpy/simulation.py"), str(domain), "5")
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield
        process.kill()


@pytest.mark.parametrize("kind", ["ours", pytest.param("rclpy", marks=needs_ros)])
def test_run_uses_simulated_time(tmp_path: Path, domain: int, kind: str):
    scenario = write_scenario(tmp_path / "mini")
    more = tmp_path / "more.yaml"
    more.write_text(f"ros2: {{clock: {{domain: {domain + 10}}}}}\n")
    command = [sys.executable, "-m", "cxbridge", "run", str(scenario), "--config", str(more)]
    with run_simulation(kind, domain + 10):
        result = subprocess.run(
            [*command, "--clock", "ros2", "--json", "--trace", str(tmp_path / "run.mcap")],
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
    assert result.returncode == 0, result.stderr
    times = [each.time_us for each in open_run(tmp_path / "run.mcap") if isinstance(each, GoalTransition)]
    assert len(times) > 4
    assert all(time_us < 1000 * MICROSECONDS for time_us in times)  # simulations begin in 1970
