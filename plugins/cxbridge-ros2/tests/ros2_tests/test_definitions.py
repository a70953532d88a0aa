"""Definitions of types, and type hashes compared with those of rosidl."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("rosbags", reason="the extra ros2 is not installed")

from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import DISTRIBUTIONS, Definitions
from cxbridge_ros2.messages import Codec
from cxbridge_ros2.names import parse_type
from ros2_tests.conftest import SETUP, needs_ros
from ros2_tests.peer import PACKAGES

WIDE_STRING_TYPE = "example_interfaces/msg/WString"
"""A type with a wide string, which is not supported."""

# the hashes that rosidl of ROS 2 Iron writes
KNOWN_HASHES = {
    "std_msgs/msg/String": "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "action_msgs/msg/GoalStatusArray": "6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e",
    "example_interfaces/srv/AddTwoInts": "e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a",
    "example_interfaces/action/Fibonacci_FeedbackMessage": (
        "c1de71afd52e49a89c53d8262366884185bc0a02f78ce051c4e46b0a7fe59bb2"
    ),
}


def load_definitions(*folders: Path, distribution: str = "jazzy") -> Definitions:
    return Definitions([PACKAGES, *folders], distribution, environment={})


@pytest.mark.parametrize("name", KNOWN_HASHES)
def test_hashes_equal_known_hashes_of_rosidl(name: str):
    assert load_definitions().compute_type_hash(parse_type(name)) == f"RIHS01_{KNOWN_HASHES[name]}"


@needs_ros
def test_hashes_equal_those_of_installed_ros():
    share = Path(SETUP) / "share"
    definitions = load_definitions(share, distribution="iron")
    hashes = {
        each["type_name"]: each["hash_string"]
        for file in share.glob("*/*/*.json")
        if file.parent.name in ("msg", "srv", "action")
        for each in json.loads(file.read_text())["type_hashes"]
    }
    hashes.pop(WIDE_STRING_TYPE, None)
    assert len(hashes) > 200
    assert {name: definitions.compute_type_hash(parse_type(name)) for name in hashes} == hashes


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_each_distribution_has_types_of_actions(distribution: str):
    definitions = Definitions([PACKAGES], distribution, environment={})
    assert definitions.has_type_hashes == (distribution != "humble")
    fields = definitions.find_fields(parse_type("example_interfaces/action/Fibonacci_SendGoal_Request"))
    assert [name for name, _ in fields] == ["goal_id", "goal"]
    assert definitions.find_fields(parse_type("action_msgs/srv/CancelGoal_Response"))


def write_definition(folder: Path, name: str, text: str) -> Path:
    file = folder / "robot_msgs" / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return file


def test_package_defines_its_types(tmp_path: Path):
    write_definition(
        tmp_path,
        "msg/Place.msg",
        "# a place\nstring<=5 name nowhere\nfloat32[2] at\nuint8 KIND=3\nPart[<=3] parts\n",
    )
    write_definition(tmp_path, "msg/Part.msg", "char sign\nint16[] sizes\n")
    write_definition(tmp_path, "srv/Find.srv", "string name\n---\nPlace place\nbool found true\n")
    (tmp_path / "robot_msgs/package.xml").write_text("<package><name>my_robot_msgs</name></package>")
    definitions = load_definitions(tmp_path)
    assert {"my_robot_msgs/msg/Place", "my_robot_msgs/srv/Find"} <= set(definitions.find_names())
    assert [name for name, _ in definitions.find_fields(parse_type("my_robot_msgs/msg/Place"))] == [
        "name",
        "at",
        "parts",
    ]
    definitions.find_fields(parse_type("my_robot_msgs/srv/Find_Response"))
    assert definitions.find_defaults(parse_type("my_robot_msgs/srv/Find_Response")) == {"found": True}
    assert definitions.find_defaults(parse_type("my_robot_msgs/msg/Place")) == {"name": "nowhere"}


def test_first_folder_takes_precedence(tmp_path: Path):
    write_definition(tmp_path / "one", "msg/Place.msg", "int8 one\n")
    write_definition(tmp_path / "two", "msg/Place.msg", "int8 two\n")
    definitions = load_definitions(tmp_path / "one", tmp_path / "two")
    assert [name for name, _ in definitions.find_fields(parse_type("robot_msgs/msg/Place"))] == ["one"]


def test_types_of_sourced_ros_are_found(tmp_path: Path):
    write_definition(tmp_path / "share", "msg/Place.msg", "int8 one\n")
    definitions = Definitions(environment={"AMENT_PREFIX_PATH": f"{tmp_path}:/nowhere"})
    assert "robot_msgs/msg/Place" in definitions.find_names()


BROKEN_DEFINITIONS = {
    "msg/A.msg": (
        "int32 a\nflaot32 b\n",
        "robot_msgs/msg/A",
        "unknown ROS 2 type robot_msgs/msg/flaot32",
    ),
    "msg/B.msg": ("int32 a b c = 5\n=\n", "robot_msgs/msg/B", "B.msg"),
    "srv/C.srv": ("int32 a\n", "robot_msgs/srv/C", "must have 2 sections, not 1"),
    "action/D.action": ("int32 a\n---\n", "robot_msgs/action/D", "must have 3 sections, not 2"),
    "msg/E.msg": ("wstring a\n", "robot_msgs/msg/E", "a wide string, which is not supported"),
}


@pytest.mark.parametrize("file", BROKEN_DEFINITIONS)
def test_broken_definition_is_reported_with_place(tmp_path: Path, file: str):
    text, name, message = BROKEN_DEFINITIONS[file]
    write_definition(tmp_path, file, text)
    with pytest.raises(Ros2Error) as caught:
        load_definitions(tmp_path).find_fields(parse_type(name))
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: load_definitions().find_fields(parse_type("geometry_msgs/msg/PoseStampd")),
            "did you mean geometry_msgs/msg/PoseStamped",
        ),
        (lambda: parse_type("PoseStamped"), "not the name of a ROS 2 type"),
        (lambda: load_definitions(Path("/nowhere")), "no such folder"),
        (lambda: load_definitions(distribution="jazy"), "did you mean jazzy"),
    ],
)
def test_unknown_name_gets_hint(make: Callable[[], object], message: str):
    with pytest.raises(Ros2Error, match=message):
        make()


def test_packages_take_precedence_over_built_in_types(tmp_path: Path):
    """A robot may have changed types. Types with fields of a changed type change, too."""
    file = tmp_path / "std_msgs/msg/Header.msg"
    file.parent.mkdir(parents=True)
    file.write_text("builtin_interfaces/Time stamp\nstring frame_id\nuint32 seq\n")
    (tmp_path / "std_msgs/package.xml").write_text("<package><name>std_msgs</name></package>")
    changed, built_in = Definitions([tmp_path], environment={}), Definitions(environment={})
    header, pose = parse_type("std_msgs/msg/Header"), parse_type("geometry_msgs/msg/PoseStamped")
    assert [field for field, _ in changed.find_fields(header)] == ["stamp", "frame_id", "seq"]
    codec = Codec(changed)
    assert codec.decode(pose, codec.encode(pose, {"header": {"seq": 7}}))["header"]["seq"] == 7
    for name in (header, pose):
        assert changed.compute_type_hash(name) != built_in.compute_type_hash(name)
