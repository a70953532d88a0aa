"""Bags of ROS 2: the conversion of runs to bags, and bags of robots that are read as runs."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rosbags", reason="the extra ros2 is not installed")

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from cxbridge.errors import TraceError
from cxbridge.events import InterfaceWrite, Level, LogLine, SkillStatus
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.run.options import RunOptions
from cxbridge.run.run import run_scenario
from cxbridge.trace.convert import convert
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.registry import open_run
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.interfaces.definitions import generate_definitions
from cxbridge_ros2.messages import Codec
from cxbridge_ros2.names import parse_type
from tests.run.mini import write_scenario

FORMATS = ["rosbag", "rosbag-sqlite3"]
UUID = bytes(range(16))
SEND_GOAL_EVENT = "example_interfaces/action/Fibonacci_SendGoal_Event"
RULER = "=" * 80
SEND_GOAL_DEFINITION = f"""service_msgs/msg/ServiceEventInfo info
example_interfaces/action/Fibonacci_SendGoal_Request[<=1] request
example_interfaces/action/Fibonacci_SendGoal_Response[<=1] response
{RULER}
MSG: example_interfaces/action/Fibonacci_SendGoal_Request
unique_identifier_msgs/msg/UUID goal_id
example_interfaces/action/Fibonacci_Goal goal
{RULER}
MSG: example_interfaces/action/Fibonacci_Goal
int32 order
{RULER}
MSG: example_interfaces/action/Fibonacci_SendGoal_Response
bool accepted
builtin_interfaces/msg/Time stamp
"""
"""The definition as the recorder of Jazzy writes it."""


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    file = folder / "run.mcap"
    run_scenario(RunOptions(scenario=write_scenario(folder / "mini"), trace=file, trace_level="facts"))
    return file


def read_contents(run: Run) -> tuple[Any, ...]:
    return list(run), {file.name: file.read() for file in run.files()}, list(run.source_records())


@pytest.mark.parametrize("bag_format", FORMATS)
def test_converted_bag_has_all_data_of_run(recording: Path, tmp_path: Path, bag_format: str):
    before = open_run(recording)
    assert convert(before, tmp_path / "bag", bag_format) == []
    after = open_run(tmp_path / "bag")
    assert after.format == "rosbag"
    assert read_contents(after) == read_contents(before)
    assert before.metadata().items() <= after.metadata().items()
    (file,) = (each for each in (tmp_path / "bag").iterdir() if each.suffix in (".mcap", ".db3"))
    assert list(open_run(file)) == list(before)
    assert not after.notes


def test_bag_is_replayed(recording: Path, tmp_path: Path):
    convert(open_run(recording), tmp_path / "bag", "rosbag")
    options = RunOptions(scenario=recording.parent / "mini", replay=(tmp_path / "bag",))
    assert run_scenario(options).status == 0


# -- bags of robots


class Bag:
    """A bag like the bags of a robot's recorder, written by the rosbags library alone."""

    def __init__(
        self, path: Path, storage: StoragePlugin = StoragePlugin.MCAP, *, compressed: bool = False
    ) -> None:
        texts = generate_definitions([InterfaceRegistry().schema("BatteryInterface")])
        packages = [Path(__file__).parent.parent / "packages"]
        self.definitions = Definitions(packages, environment={}, texts=texts)
        self.codec = Codec(self.definitions)
        self._writer = Writer(path, version=9, storage_plugin=storage)
        if compressed:
            self._writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
        self._writer.open()
        self._connections: dict[str, Any] = {}

    def add(self, topic: str, kind: str, time_s: float, message: Mapping[str, Any] | bytes) -> None:
        data = message if isinstance(message, bytes) else self.codec.encode(parse_type(kind), message)
        if topic not in self._connections:
            definition: dict[str, Any] = {"typestore": self.definitions.store}
            if kind == SEND_GOAL_EVENT:  # rosbags cannot write definitions of parts of actions
                definition = {
                    "msgdef": SEND_GOAL_DEFINITION,
                    "rihs01": self.definitions.compute_type_hash(parse_type(kind)),
                }
            self._connections[topic] = self._writer.add_connection(topic, kind, **definition)
        self._writer.write(self._connections[topic], int(time_s * 1e9), data)

    def close(self) -> None:
        self._writer.close()


def write_robot_messages(bag: Bag) -> None:
    bag.add("/rosout", "rcl_interfaces/msg/Log", 1, {"level": 30, "name": "nav", "msg": "slow"})
    goal = {"goal_id": {"uuid": UUID}, "goal": {"order": 7}}
    event = {"info": {"event_type": 1}, "request": [goal]}
    bag.add("/robot/count/_action/send_goal/_service_event", SEND_GOAL_EVENT, 2, event)
    for number, code in enumerate((1, 2, 2, 4, 4)):
        status = {"status_list": [{"goal_info": {"goal_id": {"uuid": UUID}}, "status": code}]}
        bag.add("/robot/count/_action/status", "action_msgs/msg/GoalStatusArray", 3 + number, status)
    frame = {
        "header": {"frame_id": "map"},
        "child_frame_id": "base_link",
        "transform": {"translation": {"x": 1.5}, "rotation": {"w": 1.0}},
    }
    bag.add("/tf", "tf2_msgs/msg/TFMessage", 9, {"transforms": [frame]})
    hub = {"node_id": "arm", "action": "grasp", "arguments": ["cup"]}
    bag.add("/actions_hub", "plansys2_msgs/msg/ActionExecution", 10, {**hub, "type": 3})
    bag.add("/actions_hub", "plansys2_msgs/msg/ActionExecution", 11, {**hub, "type": 6, "success": False})
    battery = {"voltage": 11, "absolute_soc": 0.5}
    bag.add("/blackboard/BatteryInterface/Robot", "cxbridge_msgs/msg/BatteryInterface", 12, battery)
    bag.add("/chatter", "std_msgs/msg/String", 13, {"data": "hello"})
    bag.close()


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize("compressed", [False, True])
def test_bag_of_robot_is_read_as_run(tmp_path: Path, storage: StoragePlugin, compressed: bool):
    write_robot_messages(Bag(tmp_path / "bag", storage, compressed=compressed))
    run = open_run(tmp_path / "bag")
    events = list(run)
    assert [each for each in events if isinstance(each, LogLine)] == [
        LogLine(1_000_000, Level.WARN, "nav", "slow")
    ]
    assert [each for each in events if isinstance(each, SkillStatus)] == [
        SkillStatus(3_000_000, "", "/robot/count", "count{order=7}", 1, "S_RUNNING"),
        SkillStatus(6_000_000, "", "/robot/count", "count{order=7}", 1, "S_FINAL"),
        SkillStatus(10_000_000, "", "arm", 'grasp{1="cup"}', 2, "S_RUNNING"),
        SkillStatus(11_000_000, "", "arm", 'grasp{1="cup"}', 2, "S_FAILED"),
    ]
    frame, battery = (each for each in events if isinstance(each, InterfaceWrite))
    assert frame.uid == "TransformInterface::/tf/ros2/base_link"
    assert (frame.values["frame"], frame.values["translation"]) == ("map", (1.5, 0.0, 0.0))
    assert battery.uid == "BatteryInterface::Robot"
    assert (battery.values["voltage"], battery.values["absolute_soc"]) == (11, 0.5)
    assert run.notes == ["left out: /chatter (std_msgs/msg/String): 1"]
    assert "/robot/count/_action/status: 5 x action_msgs/msg/GoalStatusArray" in run.description()


def test_invalid_message_becomes_note(tmp_path: Path):
    bag = Bag(tmp_path / "bag")
    bag.add("/rosout", "rcl_interfaces/msg/Log", 1, b"\0\1\0\0abc")
    bag.add("/rosout", "rcl_interfaces/msg/Log", 2, {"level": 20, "msg": "fine"})
    bag.close()
    run = open_run(tmp_path / "bag")
    assert [getattr(each, "text", "") for each in run] == ["fine"]
    (note,) = run.notes
    assert note.startswith("/rosout at 1000000000 ns: 7 bytes are not a rcl_interfaces/msg/Log")


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_truncated_bag_gives_error_or_note(tmp_path: Path, storage: StoragePlugin):
    write_robot_messages(Bag(tmp_path / "bag", storage))
    (file,) = (each for each in (tmp_path / "bag").iterdir() if each.suffix in (".mcap", ".db3"))
    data = file.read_bytes()
    failures = 0
    for part in range(1, 40):
        file.write_bytes(data[: len(data) * part // 40])
        try:
            run = open_run(tmp_path / "bag")
            list(run)
            failures += bool([each for each in run.notes if "left out" not in each])
        except TraceError as error:
            failures += str(error.file) == str(tmp_path / "bag")
    assert failures > 30


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda bag: (bag / "metadata.yaml").unlink(), "not a recorded run"),
        (lambda bag: (bag / "bag.mcap").unlink(), "Some database files are missing"),
        (lambda bag: (bag / "metadata.yaml").write_text("a: b"), "A metadata key is missing"),
        (lambda bag: (bag / "metadata.yaml").write_text("{"), "Could not load YAML"),
        (lambda bag: (bag / "metadata.yaml").write_text("[]"), "damaged ROS 2 bag"),
        (lambda bag: (bag / "bag.mcap").write_bytes(b"nothing"), "damaged ROS 2 bag"),
    ],
)
def test_damaged_bags_are_refused(tmp_path: Path, change: Any, message: str):
    write_robot_messages(Bag(tmp_path / "bag"))
    change(tmp_path / "bag")
    with pytest.raises(TraceError, match=message) as caught:
        list(open_run(tmp_path / "bag"))
    assert str(caught.value.file) == str(tmp_path / "bag")


def test_existing_bag_is_not_overwritten(recording: Path, tmp_path: Path):
    convert(open_run(recording), tmp_path / "bag", "rosbag")
    with pytest.raises(TraceError, match="exists already"):
        convert(open_run(recording), tmp_path / "bag", "rosbag")


# -- bags of other projects

ROSBAG2 = os.environ.get("ROSBAG2_DIR", "")
"""A checkout of ros2/rosbag2, whose tests have bags."""
UNREADABLE_BAGS = ("wrong_rmw_test",)


@pytest.mark.skipif(not ROSBAG2, reason="ROSBAG2_DIR names no checkout of rosbag2")
def test_bags_of_rosbag2_are_read():
    bags = [path.parent for path in Path(ROSBAG2).rglob("metadata.yaml")]
    assert len(bags) > 10
    for bag in bags:
        run = open_run(bag)
        if bag.name in UNREADABLE_BAGS:
            with pytest.raises(TraceError, match="wrong_format"):
                list(run)
            continue
        events = list(run)
        assert not [note for note in run.notes if not note.startswith("left out")], bag
        counts = {line.split(": ")[0]: int(line.split(": ")[1].split()[0]) for line in run.description()}
        assert len(events) == counts.get("/rosout", 0), bag


def test_bag_files_are_recognised_by_content(tmp_path: Path, recording: Path):
    write_robot_messages(Bag(tmp_path / "bag"))
    shutil.copy(tmp_path / "bag/bag.mcap", tmp_path / "moved.mcap")
    files = (tmp_path / "bag/bag.mcap", tmp_path / "moved.mcap", recording)
    assert [open_run(file).format for file in files] == ["rosbag", "rosbag", "mcap"]
