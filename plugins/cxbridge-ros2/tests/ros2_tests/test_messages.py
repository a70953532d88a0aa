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
from ros2_tests.conftest import HERE, needs_ros, with_ros
from ros2_tests.drawn import Drawer
from ros2_tests.peer import PACKAGES
from tests.support import many

KNOWN = Definitions([PACKAGES], environment={})
CODEC = Codec(KNOWN)
POSE = parse_type("geometry_msgs/msg/PoseStamped")
TYPE_DEFINITIONS = [name for name in KNOWN.find_names() if "/msg/" in name]


@settings(max_examples=many(400, 100), deadline=None)
@given(st.sampled_from(TYPE_DEFINITIONS), st.randoms(use_true_random=False))
def test_what_is_written_is_read(name: str, random: Random):
    message = Drawer(KNOWN, random).message(parse_type(name))
    found = CODEC.decode(parse_type(name), CODEC.encode(parse_type(name), message))
    assert repr(found) == repr(message)  # as texts, since NaN is not equal to NaN


@needs_ros
def test_rclpy_reads_what_we_write_and_writes_the_same():
    drawer = Drawer(KNOWN, Random(1))
    cases = [
        (name, CODEC.encode(parse_type(name), drawer.message(parse_type(name))).hex())
        for name in TYPE_DEFINITIONS
        for _ in range(2)
    ]
    done = subprocess.run(
        with_ros(str(HERE / "with_rclpy/cdr.py")),
        input=json.dumps(cases),
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    answers = json.loads(done.stdout)
    known = [(case, answer) for case, answer in zip(cases, answers, strict=True) if answer is not None]
    assert len(known) > 100
    for (name, ours), real in known:
        read = [repr(CODEC.decode(parse_type(name), bytes.fromhex(each))) for each in (ours, real)]
        assert read[0] == read[1], name
        if "fastrtps" not in os.environ.get("RMW_IMPLEMENTATION", ""):  # it pads with random memory
            assert real.rstrip("0") == ours.rstrip("0"), name  # rclpy may end a message with zeros


def test_what_comes_after_a_message_is_ignored():
    """As rclpy does with Fast DDS, which counts the alignment of arrays that are empty."""
    name = parse_type("std_msgs/msg/Float64MultiArray")
    real = bytes.fromhex("0001000000000000000000000000000079000000")
    assert CODEC.decode(name, real) == CODEC.decode(name, CODEC.encode(name, {}))


@pytest.mark.parametrize("level", [0, 127, 128, 255])
def test_a_byte_has_no_sign(level: int):
    name = parse_type("diagnostic_msgs/msg/DiagnosticStatus")
    data = CODEC.encode(name, {"level": level})
    assert data[4] == level
    assert CODEC.decode(name, data)["level"] == level
    many = parse_type("std_msgs/msg/ByteMultiArray")
    assert CODEC.decode(many, CODEC.encode(many, {"data": [level, 1]}))["data"] == bytes([level, 1])


def test_fields_that_are_left_out_have_their_defaults():
    found = CODEC.decode(POSE, CODEC.encode(POSE, {"pose": {"position": {"x": 1}}}))
    assert found["pose"] == {
        "position": {"x": 1.0, "y": 0.0, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    }
    assert found["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}


WRONG: dict[str, tuple[str, Any, str]] = {
    "a field that there is not": (
        "geometry_msgs/msg/PoseStamped",
        {"psoe": {}},
        "has no field 'psoe'\n  hint: did you mean pose",
    ),
    "no number": (
        "geometry_msgs/msg/PoseStamped",
        {"pose": {"position": {"x": "1"}}},
        "PoseStamped.pose.position.x must be a number",
    ),
    "true is no number": ("std_msgs/msg/Int8", {"data": True}, "must be a whole number (int8), not True"),
    "no whole number": ("std_msgs/msg/Int8", {"data": 1.5}, "must be a whole number (int8), not 1.5"),
    "too large": ("std_msgs/msg/Int8", {"data": 128}, "128 does not fit into int8 (-128 to 127)"),
    "too small": ("std_msgs/msg/UInt64", {"data": -1}, "-1 does not fit into uint64"),
    "too large a float": ("std_msgs/msg/Float32", {"data": 1e300}, "does not fit into float32"),
    "no text": ("std_msgs/msg/String", {"data": 5}, "must be a string, not 5"),
    "half a character": ("std_msgs/msg/String", {"data": "\ud800"}, "is not valid Unicode"),
    "a NUL": ("std_msgs/msg/String", {"data": "a\0b"}, "must not contain a NUL"),
    "no truth": ("std_msgs/msg/Bool", {"data": 1}, "must be true or false"),
    "no list": ("std_msgs/msg/Int8MultiArray", {"data": 5}, "must be a list"),
    "text for a list": ("std_msgs/msg/Int8MultiArray", {"data": "5"}, "must be a list"),
    "an element": ("std_msgs/msg/Int8MultiArray", {"data": [1, 300]}, "data[1]: 300 does not fit"),
    "too many elements": (
        "unique_identifier_msgs/msg/UUID",
        {"uuid": [0] * 17},
        "must have 16 elements, not 17",
    ),
    "no message": (
        "geometry_msgs/msg/PoseStamped",
        {"pose": 5},
        "must be a mapping of the fields of geometry_msgs/msg/Pose, not 5",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_value_is_one_error_that_names_the_field(case: str):
    name, message, words = WRONG[case]
    with pytest.raises(Ros2Error) as caught:
        CODEC.encode(parse_type(name), message)
    assert words in str(caught.value)


@settings(max_examples=many(500, 125), deadline=None)
@given(st.sampled_from(TYPE_DEFINITIONS), st.binary(max_size=64))
def test_bytes_that_are_no_message_are_an_error_or_a_message(name: str, data: bytes):
    with suppress(Ros2Error):
        assert isinstance(CODEC.decode(parse_type(name), data), dict)


def test_the_seeds_of_the_fuzzer_do_no_harm():
    seeds = list(fuzzed.cdr_seeds())
    assert len(seeds) > len(fuzzed.TYPES)
    for seed in seeds:
        for end in range(len(seed)):
            fuzzed.ros2_cdr(seed[:end])
            fuzzed.ros2_cdr(seed[:end] + b"\xff" + seed[end + 1 :])
