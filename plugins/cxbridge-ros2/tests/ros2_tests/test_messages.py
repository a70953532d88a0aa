"""Messages as plain values, to and from CDR."""

from __future__ import annotations

import json
import os
import subprocess
from contextlib import suppress
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("rosbags", reason="the extra ros2 is not installed")

from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.messages import Codec
from cxbridge_ros2.names import parse_type
from fuzz import ros2 as fuzzed
from ros2_tests.conftest import HERE, make_ros_python_command, needs_ros
from ros2_tests.peer import PACKAGES
from ros2_tests.random_messages import MessageGenerator
from tests.support import many

DEFINITIONS = Definitions([PACKAGES], environment={})
CODEC = Codec(DEFINITIONS)
POSE = parse_type("geometry_msgs/msg/PoseStamped")
TYPE_DEFINITIONS = [name for name in DEFINITIONS.find_names() if "/msg/" in name]


@settings(max_examples=many(400, 100), deadline=None)
@given(st.sampled_from(TYPE_DEFINITIONS), st.randoms(use_true_random=False))
def test_decoded_message_equals_encoded_message(name: str, random: Random):
    message = MessageGenerator(DEFINITIONS, random).make_message(parse_type(name))
    decoded = CODEC.decode(parse_type(name), CODEC.encode(parse_type(name), message))
    assert repr(decoded) == repr(message)  # as texts, since NaN is not equal to NaN


@needs_ros
def test_rclpy_reads_our_data_and_writes_same_data():
    generator = MessageGenerator(DEFINITIONS, Random(1))
    cases = [
        (name, CODEC.encode(parse_type(name), generator.make_message(parse_type(name))).hex())
        for name in TYPE_DEFINITIONS
        for _ in range(2)
    ]
    result = subprocess.run(
        make_ros_python_command(str(HERE / "with_rclpy/cdr.py")),
        input=json.dumps(cases),
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    answers = json.loads(result.stdout)
    known = [(case, answer) for case, answer in zip(cases, answers, strict=True) if answer is not None]
    assert len(known) > 100
    for (name, ours), real in known:
        read = [repr(CODEC.decode(parse_type(name), bytes.fromhex(each))) for each in (ours, real)]
        assert read[0] == read[1], name
        if "fastrtps" not in os.environ.get("RMW_IMPLEMENTATION", ""):  # Fast DDS pads with random memory
            assert real.rstrip("0") == ours.rstrip("0"), name  # rclpy may end a message with zeros


def test_data_after_message_are_ignored():
    """rclpy with Fast DDS adds such data for the alignment of empty arrays."""
    name = parse_type("std_msgs/msg/Float64MultiArray")
    real = bytes.fromhex("0001000000000000000000000000000079000000")
    assert CODEC.decode(name, real) == CODEC.decode(name, CODEC.encode(name, {}))


@pytest.mark.parametrize("level", [0, 127, 128, 255])
def test_byte_is_unsigned(level: int):
    name = parse_type("diagnostic_msgs/msg/DiagnosticStatus")
    data = CODEC.encode(name, {"level": level})
    assert data[4] == level
    assert CODEC.decode(name, data)["level"] == level
    array = parse_type("std_msgs/msg/ByteMultiArray")
    assert CODEC.decode(array, CODEC.encode(array, {"data": [level, 1]}))["data"] == bytes([level, 1])


def test_omitted_fields_have_defaults():
    decoded = CODEC.decode(POSE, CODEC.encode(POSE, {"pose": {"position": {"x": 1}}}))
    assert decoded["pose"] == {
        "position": {"x": 1.0, "y": 0.0, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    }
    assert decoded["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}


INVALID_VALUES: dict[str, tuple[str, Any, str]] = {
    "unknown field": (
        "geometry_msgs/msg/PoseStamped",
        {"psoe": {}},
        "has no field 'psoe'\n  hint: did you mean pose",
    ),
    "not a number": (
        "geometry_msgs/msg/PoseStamped",
        {"pose": {"position": {"x": "1"}}},
        "PoseStamped.pose.position.x must be a number",
    ),
    "true instead of a number": (
        "std_msgs/msg/Int8",
        {"data": True},
        "must be a whole number (int8), not True",
    ),
    "fraction": ("std_msgs/msg/Int8", {"data": 1.5}, "must be a whole number (int8), not 1.5"),
    "too large": ("std_msgs/msg/Int8", {"data": 128}, "128 does not fit into int8 (-128 to 127)"),
    "too small": ("std_msgs/msg/UInt64", {"data": -1}, "-1 does not fit into uint64"),
    "float too large": ("std_msgs/msg/Float32", {"data": 1e300}, "does not fit into float32"),
    "not a string": ("std_msgs/msg/String", {"data": 5}, "must be a string, not 5"),
    "surrogate": ("std_msgs/msg/String", {"data": "\ud800"}, "is not valid Unicode"),
    "NUL": ("std_msgs/msg/String", {"data": "a\0b"}, "must not contain a NUL"),
    "not a boolean": ("std_msgs/msg/Bool", {"data": 1}, "must be true or false"),
    "not a list": ("std_msgs/msg/Int8MultiArray", {"data": 5}, "must be a list"),
    "string instead of a list": ("std_msgs/msg/Int8MultiArray", {"data": "5"}, "must be a list"),
    "element out of range": ("std_msgs/msg/Int8MultiArray", {"data": [1, 300]}, "data[1]: 300 does not fit"),
    "too many elements": (
        "unique_identifier_msgs/msg/UUID",
        {"uuid": [0] * 17},
        "must have 16 elements, not 17",
    ),
    "not a message": (
        "geometry_msgs/msg/PoseStamped",
        {"pose": 5},
        "must be a mapping of the fields of geometry_msgs/msg/Pose, not 5",
    ),
}


@pytest.mark.parametrize("case", INVALID_VALUES)
def test_invalid_value_is_reported_with_field(case: str):
    name, message, text = INVALID_VALUES[case]
    with pytest.raises(Ros2Error) as caught:
        CODEC.encode(parse_type(name), message)
    assert text in str(caught.value)


@settings(max_examples=many(500, 125), deadline=None)
@given(st.sampled_from(TYPE_DEFINITIONS), st.binary(max_size=64))
def test_random_bytes_decode_to_message_or_error(name: str, data: bytes):
    with suppress(Ros2Error):
        assert isinstance(CODEC.decode(parse_type(name), data), dict)


def test_truncated_and_changed_fuzzer_seeds_are_harmless():
    seeds = list(fuzzed.cdr_seeds())
    assert len(seeds) > len(fuzzed.TYPES)
    for seed in seeds:
        for end in range(len(seed)):
            fuzzed.ros2_cdr(seed[:end])
            fuzzed.ros2_cdr(seed[:end] + b"\xff" + seed[end + 1 :])
