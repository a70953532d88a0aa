"""The mcap for Foxglove: a run like any other, and a log that its Log panel shows."""

from __future__ import annotations

import json
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from cxbridge.event_kinds import EVENT_TYPES
from cxbridge.events import Event, Level, LogLine
from cxbridge.trace.codec import field_names
from cxbridge.trace.convert import convert
from cxbridge.trace.formats.registry import open_run
from cxbridge_web.foxglove.messages import LOG_TOPIC as TOPIC
from tests.support import ROOT
from tests.trace.events import log_lines
from tests.trace.runs import MemoryRun, family


def written(tmp_path: Path, events: list[Event]) -> Path:
    path = tmp_path / "run.mcap"
    convert(MemoryRun(events), path, "foxglove")
    return path


def lines_of(path: Path) -> list[tuple[str, str, int, dict[str, object]]]:
    with path.open("rb") as file:
        found = []
        for schema, channel, message in make_reader(file).iter_messages(topics=[TOPIC]):
            assert schema is not None
            found.append((schema.name, channel.message_encoding, message.log_time, json.loads(message.data)))
        return found


def test_a_line_is_what_foxglove_calls_a_log(tmp_path):
    line = LogLine(1_500_000, Level.WARN, "CLIPS (executive)", "look out")
    (found,) = lines_of(written(tmp_path, [line]))
    assert found == (
        "foxglove.Log",
        "json",
        1_500_000_000,
        {
            "timestamp": {"sec": 1, "nsec": 500_000_000},
            "level": 3,
            "message": "look out",
            "name": "CLIPS (executive)",
            "file": "",
            "line": 0,
        },
    )


@given(st.lists(log_lines, max_size=8))
def test_the_run_is_the_same_run(tmp_path_factory, lines):
    events = [*family(), *lines]
    path = written(tmp_path_factory.mktemp("run"), events)
    assert list(open_run(path)) == events
    assert len(lines_of(path)) == len(lines)


def test_the_layout_shows_topics_and_fields_that_there_are():
    layout = json.loads((ROOT / "docs" / "foxglove" / "layout.json").read_text())
    fields = {event_type.KIND.topic: field_names(event_type) for event_type in EVENT_TYPES.values()}
    panels = layout["configById"]
    paths = [each["value"] for each in panels["StateTransitions!goals"]["paths"]]
    for path in paths:
        topic, _, field = path.rpartition(".")
        assert field in fields[topic.partition("{")[0]]
    assert panels["RosOut!log"]["topicToRender"] == TOPIC
    shown = json.dumps(layout["layout"])
    assert all(f'"{panel}"' in shown for panel in panels)
