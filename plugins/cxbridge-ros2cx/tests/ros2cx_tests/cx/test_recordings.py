"""Logs of runs, compared line by line with the logs of the real node."""

from __future__ import annotations

import re

import pytest

from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2cx.cx.hash_order import order_by_hash
from cxbridge_ros2cx.cx.parameters import NodeParameters
from ros2cx_tests.cx.recordings import (
    Recording,
    find_parameters,
    find_recordings,
    make_ros_prefix,
    normalise,
    read_environments,
    read_logs,
    run,
)
from tests.support import needs_cx, needs_newer_cx, needs_shared

pytestmark = [needs_cx, needs_shared]

TIME = r"\d+\.\d+(e[+-]?\d+)?"


def exclude(pattern):
    return lambda lines: [line for line in lines if not re.search(pattern, line)]


def exclude_commands(lines):
    """Exclude expressions of peers and ticks, because the pause is at a different time."""
    return [
        line
        for line in dict.fromkeys(lines)
        if re.match("FIRE|time between|ROS|SYS|==> f-N .executive", line)
    ]


def send_strings(topic, messages):
    """Return a peer that sends strings at given times."""

    def peer(node):
        publisher, remaining = node.create_publisher(topic, "std_msgs/msg/String"), list(messages)

        def step(seconds):
            while remaining and remaining[0][0] <= seconds:
                publisher.publish({"data": remaining.pop(0)[1]})

        return step

    return peer


send_three_strings = send_strings(
    "/ros_cx_in", [(5.0 + 2 * number, f"message {number}") for number in range(3)]
)
send_two_strings = send_strings("/ros_cx_in", [(3.0, "message 0"), (5.0, "message 1")])
send_quirks = send_strings("/quirk_in", [(2.5, f"m{number}") for number in range(30)])


def serve_bools(begin):
    """Return a peer that serves a service from a given time."""

    def answer(request):
        return {"success": request["data"], "message": f"The request was {str(request['data']).lower()}!"}

    def peer(node):
        ends: list[object] = []

        def step(seconds):
            if not ends and seconds >= begin:
                ends.append(node.serve("/ros_cx_client", "std_srvs/srv/SetBool", answer))

        return step

    return peer


def call_bools(service, begin):
    """Return a peer that calls a service with true and with false."""

    def peer(node):
        client, remaining = node.create_client(service, "std_srvs/srv/SetBool"), [True, False]

        def step(seconds):
            while remaining and seconds >= begin + 0.7 * (2 - len(remaining)):
                client.call({"data": remaining.pop(0)}, lambda _response: None)

        return step

    return peer


def send_turtle_frames(node):
    """Return a peer step that sends the frame of a turtle, which turns after 12 s."""
    publisher = node.create_publisher("/tf", "tf2_msgs/msg/TFMessage", PROFILES["tf"])

    def step(seconds):
        turned = seconds > 12
        rotation = (0.001, 0.002, 0.149, 0.988) if turned else (0.0, 0.0, 0.1494, 0.9887)
        translation = {"x": 0.95 + 0.1 * seconds, "y": 2.5, "z": 0.25 if turned else 0.0}
        transform = {"translation": translation, "rotation": dict(zip("xyzw", rotation, strict=True))}
        stamp = {"sec": 1_000_000_000 + int(seconds), "nanosec": int(seconds % 1 * 1e9)}
        header = {"frame_id": "world", "stamp": stamp}
        message = {"header": header, "child_frame_id": "turtle1", "transform": transform}
        publisher.publish({"transforms": [message]})

    return step


def change_states(*numbers):
    """Return a peer that changes the state of the node twice a second."""

    def peer(node):
        client = node.create_client("/clips_manager/change_state", "lifecycle_msgs/srv/ChangeState")
        remaining = list(enumerate(numbers))

        def step(seconds):
            if remaining and seconds > remaining[0][0] / 2:
                client.call({"transition": {"id": remaining.pop(0)[1]}}, lambda _response: None)

        return step

    return peer


def combine(*peers):
    def peer(node):
        steps = [each(node) for each in peers]

        def step(seconds):
            for each in steps:
                each(seconds)

        return step

    return peer


def exclude_failures(lines):
    """Exclude the attempts without a server, which take a second only in the recording."""
    begin = next(number for number, line in enumerate(lines) if line.startswith("Request sent")) - 1
    return [*lines[:3], *lines[begin:]]


def keep_first_attempt(lines):
    """Keep the first attempt, and the first step of the plan: the planners have different plans."""
    attempts = [number for number, line in enumerate(lines) if "FIRE N pddl-add-instance: " in line]
    steps = [number for number, line in enumerate(lines) if re.match(r"[\d.]+\([\d.]+\) ", line)]
    return [each for number, each in enumerate(lines) if number not in {*attempts[1:], *steps[1:]}]


CONVERSIONS = "-in-(int|float)"
"""The results that cxbridge converts, and for which the original reinterprets the bits of a number."""


def sort_ticks(first_rule):
    """Sort the lines of each complete tick, because two threads order simultaneous messages.

    :param first_rule: the rule that fires first in each tick.
    """

    def select(lines):
        ticks: list[list[str]] = [[]]
        for line in lines:
            if "(executive-finalize)" in line:
                break
            if line.startswith(first_rule) and not (ticks[-1] and ticks[-1][-1].startswith(first_rule)):
                ticks.append([])
            ticks[-1].append(line)
        return [line for tick in ticks[:-1] for line in sorted(tick)]

    return select


RECORDINGS = {
    "hello_world": Recording(),
    "ament_index": Recording(select=exclude("cx_z3_vendor")),  # the recorded ROS lacks the package
    "executive": Recording(16.9, TIME),
    "fibonacci_action": Recording(30, rf"{TIME}(\] [12])?"),  # the first goal has no recorded execution
    "file_load": Recording(),
    "pddl_raw_agent": Recording(10, select=keep_first_attempt),
    "pddl_parser": Recording(status=1, crashes=True),  # no environment gets beyond its plug-ins
    "protobuf": Recording(9, TIME, sort_ticks("FIRE N peer-send-msg"), crashes=True),
    "protobuf_linked": Recording(9, rf"(::ffff:)?127.0.0.1.\d+|{TIME}", crashes=True),
    "lifecycle": Recording(
        5,
        peer=change_states(3, 1, 3, 4),
        text=("environments", "autostart_node: false\n    environments"),
        crashes=True,
    ),
    "q_publish_unopened": Recording(status=1, crashes=True),
    "q_unknown_type": Recording(status=1, crashes=True),
    "q_generated": Recording(status=1),
    "quirks": Recording(select=exclude(CONVERSIONS), peer=send_quirks, status=1),
    "quirks_int_for_bool": Recording(select=exclude(CONVERSIONS), peer=send_quirks, status=1, crashes=True),
    "quirks_unknown_field": Recording(select=exclude(CONVERSIONS), peer=send_quirks, status=1, crashes=True),
    "ros_msgs_action_client": Recording(
        30, rf"{TIME}|ACCEPTED|EXECUTING", exclude("^(FIRE|[<=]=)"), crashes=True
    ),
    "ros_msgs": Recording(16, peer=send_three_strings),
    "ros_msgs_client": Recording(15, select=exclude_failures, peer=serve_bools(3.4)),
    "ros_msgs_service": Recording(15, peer=call_bools("/ros_cx_service", 3.5)),
    "ros_param": Recording(),
    "tf2": Recording(45, TIME, peer=send_turtle_frames),
    "set_bool_srv": Recording(15, peer=combine(call_bools("/ros_cx_srv", 3.6), serve_bools(0.0))),
    "config": Recording(),
    "upstream/config": Recording(),
    "upstream/executive": Recording(46.9, TIME, select=exclude_commands),
    "upstream/fibonacci_action": Recording(30, rf"{TIME}(\] [12])?"),
    "upstream/protobuf": Recording(9, TIME, sorted),  # two threads order simultaneous messages
    "upstream/protobuf_linked": Recording(9, rf"(::ffff:)?127.0.0.1.\d+|{TIME}"),
    "upstream/set_bool_srv": Recording(15, TIME, sorted),  # two threads order simultaneous responses
    "upstream/ros_msgs": Recording(16, TIME, peer=send_two_strings),
    "upstream/ros_msgs_client": Recording(10, TIME, peer=serve_bools(0.0)),
    "upstream/string_msg": Recording(
        16, TIME, peer=send_strings("/ros_cx_in", [(3, "message 0"), (5, "message 1")])
    ),
}
"""The recordings that are compared with runs."""

NOT_COMPARED = {
    "agent_clips_rcsml": "the agent has a separate checkout: test_public_agents.py",
    "empty_plugins": "the original ends before any environment: test_bad_input.py runs the file",
    "two_envs_no_log": "the original makes no second environment: test_bad_input.py runs the file",
    "tf2_clips641": "CLIPS 6.41 corrupts the second message; tf2 has the CLIPS of the executive",
    "upstream": "a folder of recordings",
}
"""The recordings without a comparable run, with the reason."""


def test_tables_have_each_recording():
    assert {*RECORDINGS, *NOT_COMPARED} == {*find_recordings()}
    assert not {*RECORDINGS} & {*NOT_COMPARED}


def test_numbers_are_converted(tmp_path):
    """The original reinterprets the bits of these numbers."""
    _, logs = run("quirks", tmp_path, RECORDINGS["quirks"])
    lines = [line.rpartition("] ")[2] for line in logs["quirks"] if re.search(CONVERSIONS, line)]
    assert lines == [
        "RESULT int-in-float64 5.0",
        "RESULT float-in-float64 5.0",
        "RESULT int-in-float32 7.0",
        "RESULT float-in-int32 2",
        "RESULT ints-in-floats 1.0 2.0",
    ]


@needs_newer_cx
def test_hash_order_equals_order_of_recordings(tmp_path):
    activations = {
        name: read_environments(name) for name in RECORDINGS if len({*read_environments(name)}) > 1
    }
    assert len(activations) >= 6
    for name, order in activations.items():
        environments = NodeParameters.load(find_parameters(name, tmp_path)).get_strings("environments")
        assert [*order_by_hash(environments)] == order


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(each, marks=[needs_newer_cx] if each.startswith("upstream/") else [])
        for each in RECORDINGS
    ],
)
def test_log_equals_recorded_log(name, tmp_path, monkeypatch):
    recording = RECORDINGS[name]
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(make_ros_prefix(tmp_path / "prefix")))
    result, logs = run(name, tmp_path, recording)
    recorded_logs = read_logs(name, crashes=recording.crashes)
    assert logs.keys() == recorded_logs.keys()
    for env, lines in recorded_logs.items():
        expected = recording.select(normalise(lines, recording.ignored))
        ours = recording.select(normalise(logs[env], recording.ignored))
        assert (ours[: len(expected)] if recording.crashes else ours) == expected
    assert result.status == recording.status, result.reason
