"""Interfaces of the blackboard as topics in both directions, and Skillers as actions."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.errors import CxbridgeError
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.interfaces.schema import FieldSchema
from cxbridge.run.agent import Run
from cxbridge.run.options import RunOptions
from cxbridge_ros2.actions import ActionClient, GoalStatus, SentGoal
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.interfaces.definitions import (
    ACTION_DEFINITIONS,
    EXEC_SKILL_TYPE,
    generate_definitions,
    make_ros_message_type,
)
from cxbridge_ros2.node import Node
from cxbridge_ros2.transports.dds import DdsNode
from ros2_tests.conftest import HERE, find_package, make_ros_python_command, needs_ros, poll_until, wait_until
from tests.daemon.test_daemon import running
from tests.run.mini import write_scenario

INTERFACE_TYPES = InterfaceRegistry().names()
BATTERY = "/blackboard/BatteryInterface/Robot"


def make_definitions(*names: str) -> dict[str, str]:
    return ACTION_DEFINITIONS | generate_definitions(map(InterfaceRegistry().schema, names))


@pytest.fixture
def node(domain: int) -> Iterator[Node]:
    texts = make_definitions("BatteryInterface", "SkillerInterface")
    with DdsNode("peer", Definitions(environment={}, texts=texts), domain + 11) as node:
        yield node


@contextmanager
def start_run(folder: Path, domain: int, topics: str) -> Iterator[Run]:
    folder.mkdir(exist_ok=True)
    more = folder / "more.yaml"
    more.write_text(f"ros2:\n  interfaces:\n{topics}".replace("DOMAIN", f"domain: {domain + 11}"))
    options = RunOptions(
        scenario=write_scenario(folder / "mini"), config=(more,), clock="real", skiller="none"
    )
    with Run(options) as run:
        run.start()
        yield run


def loop_until(run: Run, node: Node | None, condition: Callable[[], Any], limit_s: float = 10.0) -> None:
    wait_until(condition, run.loop.run_once, *([node.poll] if node is not None else []), limit_s=limit_s)


def test_topic_gets_each_write(tmp_path: Path, domain: int, node: Node):
    got: list[Any] = []
    node.subscribe(BATTERY, make_ros_message_type("BatteryInterface"), got.append)
    with start_run(tmp_path, domain, "    all: {interface: 'Battery*', DOMAIN}\n") as run:
        battery = run.board.open_for_writing("BatteryInterface", "Robot")
        while not got:  # until the publisher has found the subscription
            battery.set("current", 1)
            battery.write()
            run.loop.run_once()
            node.poll(0.05)
        got.clear()
        for voltage in (11500, 11400, 11300):  # all writes of one loop
            battery.set("voltage", voltage)
            battery.set("absolute_soc", 0.5)
            battery.write()
        loop_until(run, node, lambda: len(got) >= 3)
        assert [each["voltage"] for each in got if each["voltage"]] == [11500, 11400, 11300]
        assert got[-1]["absolute_soc"] == 0.5
        stamp = got[-1]["timestamp"]
        assert stamp["sec"] * 10**6 + stamp["nanosec"] // 1000 == battery.timestamp_us
        battery.close()


def test_writes_are_converted_to_configured_message_type(tmp_path: Path, domain: int, node: Node):
    got: list[Any] = []
    node.subscribe("/robot1/battery", "sensor_msgs/msg/BatteryState", got.append)
    topics = (
        "    battery:\n      interface: BatteryInterface::Robot\n      topic: /battery\n      DOMAIN\n"
        "      type: sensor_msgs/msg/BatteryState\n      namespace: /robot1\n      stamp: header.stamp\n"
        "      constants: {header.frame_id: base, power_supply_technology: 2}\n"
        "      fields: {voltage: voltage, absolute_soc: percentage}\n"
    )
    with start_run(tmp_path, domain, topics) as run:
        battery = run.board.open_for_writing("BatteryInterface", "Robot")
        battery.set("voltage", 12)
        battery.set("absolute_soc", 0.25)

        def is_received() -> bool:
            battery.write()
            return bool(got)

        loop_until(run, node, is_received)
        assert (got[0]["voltage"], got[0]["percentage"], got[0]["power_supply_technology"]) == (12.0, 0.25, 2)
        assert got[0]["header"]["frame_id"] == "base"
        assert got[0]["header"]["stamp"]["sec"] > 10**9
        battery.close()


def test_received_messages_are_written_to_interface(tmp_path: Path, domain: int, node: Node):
    state = node.create_publisher("/battery", "sensor_msgs/msg/BatteryState")
    topics = (
        "    battery: {interface: 'BatteryInterface::Robot', direction: write, topic: /battery, DOMAIN,\n"
        "      type: sensor_msgs/msg/BatteryState, fields: {absolute_soc: percentage}}\n"
    )
    with start_run(tmp_path, domain, topics) as run:
        battery = run.board.open_for_reading("BatteryInterface", "Robot")

        def is_received() -> bool:
            state.publish({"percentage": 0.75})
            battery.read()
            return bool(battery.get("absolute_soc") == 0.75)

        loop_until(run, node, is_received)
        battery.close()


def make_value(field: FieldSchema, rng: Random) -> Any:
    if field.type == "string":
        return "".join(rng.choice("abc äß\t") for _ in range(rng.randrange((field.length or 8) // 2)))
    elements = tuple(make_element(field, rng) for _ in range(field.length or 1))
    return elements if field.is_array else elements[0]


def make_element(field: FieldSchema, rng: Random) -> Any:
    if field.enum is not None:
        return rng.choice(field.enum.items).value
    makers: dict[type, Callable[[], Any]] = {
        bool: lambda: rng.random() < 0.5,
        float: lambda: rng.randrange(-1000, 1000) / 8,
        int: lambda: rng.randint(*field.storage.limits),
    }
    return makers[field.storage.python_type]()


def test_all_interface_types_are_copied_between_runs(tmp_path: Path, domain: int):
    """One run publishes random values of all types, and a second run writes them."""
    rng = Random(1)
    writes = "".join(
        f"    t{n}: {{interface: '{name}::Copied', direction: write, DOMAIN}}\n"
        for n, name in enumerate(INTERFACE_TYPES)
    )
    with (
        start_run(
            tmp_path / "a", domain, "    all: {interface: '*::Copied', qos: latched, DOMAIN}\n"
        ) as source,
        start_run(tmp_path / "b", domain, writes) as target,
    ):
        written, read = {}, {}
        for name in INTERFACE_TYPES:
            writer = written[name] = source.board.open_for_writing(name, "Copied")
            read[name] = target.board.open_for_reading(name, "Copied")
            for field in writer.SCHEMA.fields:
                writer.set(field.name, make_value(field, rng))

        def find_differences() -> list[str]:
            for each in read.values():
                each.read()
            return [name for name in INTERFACE_TYPES if read[name].as_dict() != written[name].as_dict()]

        def equal() -> bool:
            for each in written.values():
                each.write()
            target.loop.run_once()
            return not find_differences()

        loop_until(source, None, equal, limit_s=30)
        for each in (*written.values(), *read.values()):
            each.close()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{interface: ''}", "selects no interface"),
        ("{interfaec: 'A::b'}", "has no setting 'interfaec'"),
        ("{interface: 'BatteryInterface::R', direction: both}", "unknown direction 'both'"),
        ("{interface: 'BatteryInterface::*', direction: write}", "must name one interface"),
        ("{interface: 'BatteryInterface::*', topic: /a}", "must name one interface"),
        ("{interface: 'BatteryInterface::R', topic: a}", "'a' is not an absolute name"),
        ("{interface: 'BatteryInterface::R', fields: {voltage: v}}", "'fields' requires a 'type'"),
        (
            "{interface: 'BatteryInterface::R', type: std_msgs/msg/String, fields: {volts: data}}",
            "has no field 'volts'",
        ),
        (
            "{interface: 'BatteryInterface::R', type: std_msgs/msg/Strin, fields: {voltage: data}}",
            "unknown ROS 2 type std_msgs/msg/Strin",
        ),
        ("{interface: 'BaterryInterface::R', direction: write}", "BaterryInterface"),
        ("{interface: 'BatteryInterface::R', qos: fast}", "there is no QoS profile 'fast'"),
    ],
)
def test_invalid_settings_are_refused(tmp_path: Path, domain: int, text: str, message: str):
    with (
        pytest.raises(CxbridgeError, match=message) as caught,
        start_run(tmp_path, domain, f"    x: {text}\n"),
    ):
        pass
    assert str(caught.value.file) == str(tmp_path / "more.yaml")


# -- Skillers


@contextmanager
def run_skiller_daemon(folder: Path, domain: int) -> Iterator[Daemon]:
    file = folder / "daemon.yaml"
    quiet = "cxbridge: {fawkes: {enable: false}, zmq: {endpoints: []}}\n"
    file.write_text(f"{quiet}ros2: {{skiller: {{domain: {domain + 11}}}}}\n")
    with running(DaemonOptions(config=file)) as (daemon, _lines, _outcome):
        yield daemon


def execute(node: Node, client: ActionClient, text: str, *, steal: bool = False) -> SentGoal:
    poll_until(node, lambda: client.has_server)
    sent = client.send({"skill_string": text, "steal": steal})
    poll_until(node, lambda: sent.is_over)
    return sent


def test_goal_executes_skill_string(tmp_path: Path, domain: int, node: Node):
    with (
        run_skiller_daemon(tmp_path, domain) as daemon,
        ActionClient(node, "/skiller/execute", EXEC_SKILL_TYPE) as client,
    ):
        succeeded = execute(node, client, 'say{text="hello", wait=true}')
        assert (succeeded.status, succeeded.result) == (GoalStatus.SUCCEEDED, {"success": True, "error": ""})
        assert succeeded.feedback == {"status": "S_RUNNING"}
        failed = execute(node, client, "fly{}")
        assert failed.status is GoalStatus.ABORTED
        assert failed.result is not None
        assert "fly" in failed.result["error"]
        long = client.send({"skill_string": 'say{text="a long text, which takes its time", wait=true}'})
        poll_until(node, lambda: long.feedback)
        long.cancel()
        poll_until(node, lambda: long.is_over)
        assert long.status is GoalStatus.CANCELED
        thief: Interface = daemon.board.open_for_reading("SkillerInterface", "Skiller")
        thief.msgq_enqueue(thief.create_message("AcquireControlMessage"))
        poll_until(node, lambda: thief.read() or thief.get("exclusive_controller"))
        refused = execute(node, client, 'say{text="mine"}')
        assert refused.status is GoalStatus.ABORTED
        assert refused.result is not None
        assert "has control of the Skiller" in refused.result["error"]
        stolen = execute(node, client, 'say{text="mine"}', steal=True)
        assert stolen.status is GoalStatus.SUCCEEDED
        thief.close()


@needs_ros
def test_rclpy_reads_interfaces_and_executes_skills(tmp_path: Path, domain: int):
    if find_package("cxbridge_msgs") is None:
        pytest.skip("no cxbridge_msgs in ROS2_OVERLAY: see docs/ros2.md, 'cxbridge ros2 package'")
    file = tmp_path / "daemon.yaml"
    quiet = "cxbridge: {fawkes: {enable: false}, zmq: {endpoints: []}}\n"
    place = f"domain: {domain + 11}"
    topics = f"interfaces: {{skiller: {{interface: SkillerInterface, qos: latched, {place}}}}}"
    file.write_text(f"{quiet}ros2: {{skiller: {{{place}}}, {topics}}}\n")
    with running(DaemonOptions(config=file)):
        result = subprocess.run(
            make_ros_python_command(str(HERE / "with_rclpy/skiller_user.py"), str(domain + 11)),
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.splitlines() == ["4 True ", "6 False ", 'say{text="hello", wait=true}']
