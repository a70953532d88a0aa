"""Agents of today's executive behave here as in the real node: its logs, line by line."""

from __future__ import annotations

import re

import pytest

from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2cx.cx.hash_order import order_by_hash
from cxbridge_ros2cx.cx.parameters import NodeParameters
from ros2cx_tests.cx.recordings import (
    Recording,
    activated,
    comparable,
    names,
    parameters,
    recorded,
    run,
    sourced,
)
from tests.support import needs_cx, needs_newer_cx, needs_shared

pytestmark = [needs_cx, needs_shared]

TIME = r"\d+\.\d+(e[+-]?\d+)?"


def without(pattern):
    return lambda lines: [line for line in lines if not re.search(pattern, line)]


def without_commands(lines):
    """Leave out what peers have evaluated, and the ticks: a pause is in another place."""
    return [
        line
        for line in dict.fromkeys(lines)
        if re.match("FIRE|time between|ROS|SYS|==> f-N .executive", line)
    ]


def first(count):
    return lambda lines: lines[:count]


def sends(topic, messages):
    """Send strings at times."""

    def peer(node):
        publisher, left = node.create_publisher(topic, "std_msgs/msg/String"), list(messages)

        def step(seconds):
            while left and left[0][0] <= seconds:
                publisher.publish({"data": left.pop(0)[1]})

        return step

    return peer


sends_strings = sends("/ros_cx_in", [(5.0 + 2 * number, f"message {number}") for number in range(3)])
two_strings = sends("/ros_cx_in", [(3.0, "message 0"), (5.0, "message 1")])
quirks = sends("/quirk_in", [(2.5, f"m{number}") for number in range(30)])


def serves_bools(begin):
    """Serve from a time on."""

    def answer(request):
        return {"success": request["data"], "message": f"The request was {str(request['data']).lower()}!"}

    def peer(node):
        ends: list[object] = []

        def step(seconds):
            if not ends and seconds >= begin:
                ends.append(node.serve("/ros_cx_client", "std_srvs/srv/SetBool", answer))

        return step

    return peer


def calls(service, begin):
    """Call with true, and with false."""

    def peer(node):
        client, left = node.create_client(service, "std_srvs/srv/SetBool"), [True, False]

        def step(seconds):
            while left and seconds >= begin + 0.7 * (2 - len(left)):
                client.call({"data": left.pop(0)}, lambda _response: None)

        return step

    return peer


def turtle(node):
    """Send the frame of a turtle that turns after 12 s."""
    publisher = node.create_publisher("/tf", "tf2_msgs/msg/TFMessage", PROFILES["tf"])

    def step(seconds):
        turned = seconds > 12
        rotation = (0.001, 0.002, 0.149, 0.988) if turned else (0.0, 0.0, 0.1494, 0.9887)
        moved = {"x": 0.95 + 0.1 * seconds, "y": 2.5, "z": 0.25 if turned else 0.0}
        transform = {"translation": moved, "rotation": dict(zip("xyzw", rotation, strict=True))}
        stamp = {"sec": 1_000_000_000 + int(seconds), "nanosec": int(seconds % 1 * 1e9)}
        header = {"frame_id": "world", "stamp": stamp}
        message = {"header": header, "child_frame_id": "turtle1", "transform": transform}
        publisher.publish({"transforms": [message]})

    return step


def transitions(*numbers):
    """Change the state of the node, twice a second."""

    def peer(node):
        client = node.create_client("/clips_manager/change_state", "lifecycle_msgs/srv/ChangeState")
        left = list(enumerate(numbers))

        def step(seconds):
            if left and seconds > left[0][0] / 2:
                client.call({"transition": {"id": left.pop(0)[1]}}, lambda _response: None)

        return step

    return peer


def both(*peers):
    def peer(node):
        steps = [each(node) for each in peers]

        def step(seconds):
            for each in steps:
                each(seconds)

        return step

    return peer


def without_failures(lines):
    """Leave out the attempts without a server: ours do not take a second each."""
    begin = next(number for number, line in enumerate(lines) if line.startswith("Request sent")) - 1
    return [*lines[:3], *lines[begin:]]


def one_attempt_and_its_plan(lines):
    """Leave out the attempt without a manager; another planner has another plan, which begins alike."""
    attempts = [number for number, line in enumerate(lines) if "FIRE N pddl-add-instance: " in line]
    steps = [number for number, line in enumerate(lines) if re.match(r"[\d.]+\([\d.]+\) ", line)]
    return [each for number, each in enumerate(lines) if number not in {*attempts[1:], *steps[1:]}]


CONVERTED = "-in-(int|float)"
"""The results where the original takes the bits of a number for another: ours convert."""


def by_ticks(first):
    """Sort the lines of each whole tick: messages come at once in the order of two threads.

    :param first: the rule that fires first in each tick.
    """

    def compared(lines):
        ticks: list[list[str]] = [[]]
        for line in lines:
            if "(executive-finalize)" in line:
                break
            if line.startswith(first) and not (ticks[-1] and ticks[-1][-1].startswith(first)):
                ticks.append([])
            ticks[-1].append(line)
        return [line for tick in ticks[:-1] for line in sorted(tick)]

    return compared


RECORDINGS = {
    "hello_world": Recording(),
    "ament_index": Recording(compared=without("cx_z3_vendor")),  # that package was not built there
    "executive": Recording(16.9, TIME),
    "fibonacci_action": Recording(30, rf"{TIME}(\] [12])?"),  # the first goal was never seen to execute
    "file_load": Recording(),
    "pddl_raw_agent": Recording(10, compared=one_attempt_and_its_plan),
    "pddl_parser": Recording(status=1, dies=True),  # no environment gets further than its plug-ins
    "protobuf": Recording(9, TIME, by_ticks("FIRE N peer-send-msg"), dies=True),
    "protobuf_linked": Recording(9, rf"(::ffff:)?127.0.0.1.\d+|{TIME}", dies=True),
    "lifecycle": Recording(
        5,
        peer=transitions(3, 1, 3, 4),
        text=("environments", "autostart_node: false\n    environments"),
        dies=True,
    ),
    "q_publish_unopened": Recording(status=1, dies=True),
    "q_unknown_type": Recording(status=1, dies=True),
    "q_generated": Recording(status=1),
    "quirks": Recording(compared=without(CONVERTED), peer=quirks, status=1),
    "quirks_int_for_bool": Recording(compared=without(CONVERTED), peer=quirks, status=1, dies=True),
    "quirks_unknown_field": Recording(compared=without(CONVERTED), peer=quirks, status=1, dies=True),
    "ros_msgs_action_client": Recording(
        30, rf"{TIME}|ACCEPTED|EXECUTING", without("^(FIRE|[<=]=)"), dies=True
    ),
    "ros_msgs": Recording(16, peer=sends_strings),
    "ros_msgs_client": Recording(15, compared=without_failures, peer=serves_bools(3.4)),
    "ros_msgs_service": Recording(15, peer=calls("/ros_cx_service", 3.5)),
    "ros_param": Recording(),
    "tf2": Recording(45, TIME, peer=turtle),
    "set_bool_srv": Recording(15, peer=both(calls("/ros_cx_srv", 3.6), serves_bools(0.0))),
    "config": Recording(),
    "upstream/config": Recording(),
    "upstream/executive": Recording(46.9, TIME, compared=without_commands),
    "upstream/fibonacci_action": Recording(30, rf"{TIME}(\] [12])?"),
    "upstream/protobuf": Recording(9, TIME, sorted),  # messages at once, in the order of two threads
    "upstream/protobuf_linked": Recording(9, rf"(::ffff:)?127.0.0.1.\d+|{TIME}"),
    "upstream/set_bool_srv": Recording(15, TIME, sorted),  # two responses at once, of two threads
    "upstream/ros_msgs": Recording(16, TIME, peer=two_strings),
    "upstream/ros_msgs_client": Recording(10, TIME, peer=serves_bools(0.0)),
    "upstream/string_msg": Recording(
        16, TIME, peer=sends("/ros_cx_in", [(3, "message 0"), (5, "message 1")])
    ),
}
"""The recordings that ours are compared with."""

NOT_REACHED = {
    "agent_clips_rcsml": "its agent is another checkout: test_public_agents.py",
    "empty_plugins": "the original ends before it makes an environment: test_bad_input.py has the file",
    "two_envs_no_log": "the original makes no second environment: test_bad_input.py has the file",
    "tf2_clips641": "that CLIPS corrupts the second message; tf2 is the same with the CLIPS of the executive",
    "upstream": "a folder of recordings",
}
"""The recordings that are no runs of an environment here, and why."""


def test_each_recording_is_in_a_table():
    assert {*RECORDINGS, *NOT_REACHED} == {*names()}
    assert not {*RECORDINGS} & {*NOT_REACHED}


def test_numbers_convert(tmp_path):
    """Where the original takes the bits of another type."""
    _, logs = run("quirks", tmp_path, RECORDINGS["quirks"])
    lines = [line.rpartition("] ")[2] for line in logs["quirks"] if re.search(CONVERTED, line)]
    assert lines == [
        "RESULT int-in-float64 5.0",
        "RESULT float-in-float64 5.0",
        "RESULT int-in-float32 7.0",
        "RESULT float-in-int32 2",
        "RESULT ints-in-floats 1.0 2.0",
    ]


@needs_newer_cx
def test_hash_order_is_that_of_the_recordings(tmp_path):
    several = {name: activated(name) for name in RECORDINGS if len({*activated(name)}) > 1}
    assert len(several) >= 6
    for name, order in several.items():
        given = NodeParameters.load(parameters(name, tmp_path)).get_strings("environments")
        assert [*order_by_hash(given)] == order


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(each, marks=[needs_newer_cx] if each.startswith("upstream/") else [])
        for each in RECORDINGS
    ],
)
def test_log_is_that_of_the_recording(name, tmp_path, monkeypatch):
    recording = RECORDINGS[name]
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(sourced(tmp_path / "prefix")))
    result, logs = run(name, tmp_path, recording)
    there = recorded(name, dies=recording.dies)
    assert logs.keys() == there.keys()
    for env, lines in there.items():
        wanted = recording.compared(comparable(lines, recording.without))
        ours = recording.compared(comparable(logs[env], recording.without))
        assert (ours[: len(wanted)] if recording.dies else ours) == wanted
    assert result.status == recording.status, result.reason
