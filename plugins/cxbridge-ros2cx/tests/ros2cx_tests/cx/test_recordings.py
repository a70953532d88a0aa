"""Agents of today's executive do here what they did in the real node: its logs, line by line."""

from __future__ import annotations

import pytest

from ros2cx_tests.cx.recordings import Recording, comparable, names, recorded, run, sourced
from tests.support import needs_cx, needs_shared

pytestmark = [needs_cx, needs_shared]

TIME = r"\d+\.\d+(e[+-]?\d+)?"


def without(text):
    return lambda lines: [line for line in lines if text not in line]


RECORDINGS = {
    "hello_world": Recording(),
    "ament_index": Recording(compared=without("cx_z3_vendor")),  # nobody had built that one
    "executive": Recording(16.9, TIME),
    "file_load": Recording(),
    "config": Recording(),
}
"""The recordings that ours are compared with."""

NOT_REACHED = {
    **dict.fromkeys(
        ("agent_clips_rcsml", "protobuf", "protobuf_linked", "upstream/protobuf", "upstream/protobuf_linked"),
        "protobuf",
    ),
    **dict.fromkeys(
        ("q_publish_unopened", "q_unknown_type", "quirks", "quirks_int_for_bool", "quirks_unknown_field"),
        "ros_msgs",
    ),
    **dict.fromkeys(
        ("ros_msgs", "ros_msgs_action_client", "ros_msgs_client", "ros_msgs_service", "upstream/ros_msgs"),
        "ros_msgs",
    ),
    "upstream/ros_msgs_client": "ros_msgs",
    **dict.fromkeys(
        ("fibonacci_action", "q_generated", "set_bool_srv", "upstream/fibonacci_action"), "generated classes"
    ),
    **dict.fromkeys(("upstream/set_bool_srv", "upstream/string_msg"), "generated classes"),
    **dict.fromkeys(("pddl_parser", "pddl_raw_agent"), "PDDL"),
    **dict.fromkeys(("tf2", "tf2_clips641"), "tf2_pose_tracker"),
    **dict.fromkeys(("upstream", "upstream/config", "upstream/executive"), "the switch to pull request 33"),
    **dict.fromkeys(("empty_plugins", "two_envs_no_log"), "the original dies"),
    "lifecycle": "the services of the node",
    "ros_param": "ros_param",
}
"""The recordings that nothing is compared with yet, and what they need."""


def test_each_recording_is_in_a_table():
    assert {*RECORDINGS, *NOT_REACHED} == {*names()}
    assert not {*RECORDINGS} & {*NOT_REACHED}


@pytest.mark.parametrize("name", RECORDINGS)
def test_log_is_that_of_the_recording(name, tmp_path, monkeypatch):
    recording = RECORDINGS[name]
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(sourced(tmp_path / "prefix")))
    result, logs = run(name, tmp_path / "logs", recording.seconds)
    there = recorded(name)
    assert logs.keys() == there.keys()
    for env, lines in there.items():
        wanted = recording.compared(comparable(lines, recording.without))
        assert recording.compared(comparable(logs[env], recording.without)) == wanted
    assert (result.status, result.reason) == (0, "its time is over, and no error was reported")
