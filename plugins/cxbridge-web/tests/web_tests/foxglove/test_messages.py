"""Messages for Foxglove's panels compared with Foxglove's published schemas."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from cxbridge.event_kinds import EVENT_TYPES
from cxbridge.events import Event, InterfaceWrite, Level, LogLine, NavGraphRead
from cxbridge.trace.codec import field_names
from cxbridge.trace.convert import convert
from cxbridge.trace.formats.registry import open_run
from cxbridge_web.foxglove.messages import LOG_TOPIC, FoxgloveMessage, make_foxglove_messages
from cxbridge_web.foxglove.schemas import make_json_schema
from tests.support import ROOT
from tests.trace.events import events as any_event
from tests.trace.runs import MemoryRun
from web_tests.foxglove.published import check_message, check_schema, descriptor

NO_ROTATION = [0.0, 0.0, 0.0, 1.0]


def pose(**changes: Any) -> InterfaceWrite:
    values = {
        "frame": "/map",
        "translation": [1.0, 2.0, 0.5],
        "rotation": NO_ROTATION,
        "visibility_history": 1,
    }
    return InterfaceWrite(1_500_000, "Position3DInterface::Pose", values | changes)


def transform(**changes: Any) -> InterfaceWrite:
    values = {
        "frame": "map",
        "child_frame": "/base_link",
        "static_transform": False,
        "translation": [1.0, 0.0, 0.0],
        "rotation": NO_ROTATION,
    }
    return InterfaceWrite(2_000_000, "TransformInterface::/tf/base_link", values | changes)


def graph() -> NavGraphRead:
    nodes = {
        "hall": {"x": 0.0, "y": 0.0, "unconnected": False, "properties": {}},
        "kitchen": {"x": 4, "y": 3.0, "unconnected": False, "properties": {"room": "true"}},
        "roof": {"x": 9.0, "y": 9.0, "unconnected": True, "properties": {}},
    }
    edges = {
        "hall--kitchen": {"from": "hall", "to": "kitchen", "directed": False},
        "kitchen->hall": {"from": "kitchen", "to": "hall", "directed": True},
    }
    return NavGraphRead(1_000_000, "House", nodes, edges)


def navigator(**changes: Any) -> InterfaceWrite:
    values = {"x": 1.5, "y": -2.0, "target_frame": ""}
    return InterfaceWrite(3_000_000, "NavigatorInterface::Navigator", values | changes)


ALL: list[Event] = [
    LogLine(1, Level.ERROR, "Test", "no \ud83e way"),
    pose(),
    transform(),
    navigator(),
    graph(),
]


def single_message(event: Event) -> FoxgloveMessage:
    (message,) = make_foxglove_messages(event)
    return message


@pytest.mark.parametrize("message", ["Log", "PoseInFrame", "FrameTransform", "SceneUpdate"])
def test_schemas_have_fields_of_published_schemas(message):
    check_schema(make_json_schema(message), descriptor(message))


@pytest.mark.parametrize("event", [pose(), transform(), navigator(), graph(), *ALL[:1]])
def test_message_matches_published_schema(event):
    message = single_message(event)
    if isinstance(event, LogLine):
        message = single_message(LogLine(1, Level.ERROR, "Test", "no way"))  # protobuf refuses surrogates
    check_message(message.schema_name, message.data)


def test_pose_has_frame_and_time():
    message = single_message(pose())
    assert (message.topic, message.schema_name) == ("/foxglove/pose/Position3DInterface/Pose", "PoseInFrame")
    assert message.data == {
        "timestamp": {"sec": 1, "nsec": 500_000_000},
        "frame_id": "map",
        "pose": {
            "position": {"x": 1.0, "y": 2.0, "z": 0.5},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
    }


def test_transform_has_parent_and_child():
    message = single_message(transform())
    assert (message.topic, message.subject) == ("/foxglove/tf", "base_link")
    data = message.data
    assert (data["parent_frame_id"], data["child_frame_id"]) == ("map", "base_link")


def test_navigator_has_odometry_frame_by_default():
    assert single_message(navigator()).data["frame_id"] == "odom"
    assert single_message(navigator(target_frame="/map")).data["frame_id"] == "map"


def test_navgraph_is_entity_with_nodes_edges_and_names():
    (entity,) = single_message(graph()).data["entities"]
    assert (entity["id"], entity["frame_id"]) == ("House", "map")
    assert len(entity["spheres"]) == len(entity["texts"]) == 3
    assert [text["text"] for text in entity["texts"]] == ["hall", "kitchen", "roof"]
    (line,) = entity["lines"]
    assert [(point["x"], point["y"]) for point in line["points"]] == [(0.0, 0.0), (4, 3.0)]
    (arrow,) = entity["arrows"]
    assert arrow["shaft_length"] + arrow["head_length"] == pytest.approx(5.0)
    turn = arrow["pose"]["orientation"]
    direction = (1 - 2 * turn["z"] ** 2, 2 * turn["z"] * turn["w"])  # the direction of the arrow's x axis
    assert direction == pytest.approx((-0.8, -0.6))


@pytest.mark.parametrize(
    "event",
    [
        pose(frame=""),  # an interface before its first write
        pose(translation=(math.nan, 0.0, 0.0)),
        pose(rotation=(0.0, 1.0)),
        transform(child_frame=""),
        navigator(x=math.inf),
        InterfaceWrite(1, "SkillerInterface::Skiller", {"msgid": 1}),
    ],
)
def test_event_without_place_has_no_message(event):
    assert list(make_foxglove_messages(event)) == []


def test_invalid_parts_of_navgraph_are_left_out():
    nodes = {"a": {"x": "far", "y": 0}, "b": {}, "c": {"x": 1.0, "y": 2.0}}
    edges = {"a--c": {"from": "a", "to": "c"}, "?": {}}
    (entity,) = single_message(NavGraphRead(1, "Odd", nodes, edges)).data["entities"]
    assert (len(entity["spheres"]), entity["lines"], entity["arrows"]) == (1, [], [])


@given(st.lists(any_event, max_size=8))
def test_converted_run_has_same_events_and_valid_messages(tmp_path_factory, events):
    path: Path = tmp_path_factory.mktemp("run") / "run.mcap"
    events = [*events, pose(), transform(), navigator(), graph()]
    convert(MemoryRun(events), path, "foxglove")
    assert list(open_run(path)) == events
    counts: dict[str, int] = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert schema is not None
            if not channel.topic.startswith("/foxglove/"):
                continue
            assert channel.message_encoding == "json"
            assert schema.name.startswith("foxglove.")
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            if channel.topic != "/foxglove/log":
                check_message(schema.name.removeprefix("foxglove."), json.loads(message.data))
    assert {
        "/foxglove/pose/Position3DInterface/Pose",
        "/foxglove/pose/NavigatorInterface/Navigator",
        "/foxglove/tf",
        "/foxglove/navgraph/House",
    } <= set(counts)


def test_layout_has_existing_topics_and_fields():
    layout = json.loads((ROOT / "docs" / "foxglove" / "layout.json").read_text())
    fields = {event_type.KIND.topic: field_names(event_type) for event_type in EVENT_TYPES.values()}
    panels = layout["configById"]
    paths = [each["value"] for each in panels["StateTransitions!goals"]["paths"]]
    for path in paths:
        topic, _, field = path.rpartition(".")
        assert field in fields[topic.partition("{")[0]]
    assert panels["RosOut!log"]["topicToRender"] == LOG_TOPIC
    shown = json.dumps(layout["layout"])
    assert all(f'"{panel}"' in shown for panel in panels)
