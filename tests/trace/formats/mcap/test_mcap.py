"""Mcap files of cxbridge: the mcap library reads them, and damaged files keep the earlier events."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer

from cxbridge.errors import TraceError
from cxbridge.events import Event, InterfaceMessage, InterfaceWrite
from cxbridge.trace.codec import encode, event_json_schema
from cxbridge.trace.formats.base import Attachment
from cxbridge.trace.formats.mcap.reader import McapRun
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from tests.support import many
from tests.trace import events as strategies
from tests.trace.runs import family, goal

HUGE_TIME = json.dumps({**json.loads(encode(family()[0])), "time_us": 1 << 63}).encode()


def write(path: Path, events: list[Event]) -> Path:
    writer = McapWriter(path)
    for event in events:
        writer.write(event)
    writer.close()
    writer.close()
    return path


@settings(max_examples=many(60, 25))
@given(st.lists(strategies.events, max_size=10))
def test_mcap_events_round_trip(tmp_path_factory: pytest.TempPathFactory, events: list[Event]) -> None:
    run = open_run(write(tmp_path_factory.mktemp("mcap") / "run", events))
    assert isinstance(run, McapRun)
    assert list(run) == events == list(run)
    assert not run.notes


def test_library_reads_topics_schemas_and_times(tmp_path: Path) -> None:
    uid = "AInterface::b::c"
    events = [
        goal("gen1", "FORMULATED", time_us=5),
        InterfaceWrite(6, uid, {"x": 1}),
        InterfaceMessage(6, uid, "AMessage", 1, "me", "queued", {"x": 1}),
    ]
    with write(tmp_path / "run", events).open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        entries = [(c.topic, s.name, json.loads(s.data), m) for s, c, m in reader.iter_messages() if s]
        summary = reader.get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == 3
    assert [(topic, name) for topic, name, _, _ in entries] == [
        ("/goals", "cxbridge.GoalTransition"),
        ("/bb/AInterface/b::c", "cxbridge.InterfaceWrite"),
        ("/messages/AInterface/b::c", "cxbridge.InterfaceMessage"),
    ]
    assert entries[0][2] == event_json_schema(type(events[0]))
    assert [(message.log_time, message.publish_time) for *_, message in entries] == [
        (5000, 5000),
        (6000, 6000),
        (6000, 6000),
    ]


def test_metadata_and_attachments_round_trip(tmp_path: Path) -> None:
    attachment = Attachment("test/domain.pddl", "text/plain", b"(define)")
    with McapWriter(tmp_path / "run") as writer:
        writer.describe({"spec": "test", "result": "running"})
        writer.attach(attachment)
        for event in family():
            writer.write(event)
        writer.describe({"result": "completed"})
    run = open_run(tmp_path / "run")
    assert run.metadata() == {"spec": "test", "result": "completed"}
    assert list(run.attachments()) == [attachment]
    assert list(run) == family()


def test_file_of_killed_run_has_events_before_last_flush(tmp_path: Path) -> None:
    with McapWriter(tmp_path / "running") as writer:
        for event in family():
            writer.write(event)
        writer.flush()
        (tmp_path / "run").write_bytes((tmp_path / "running").read_bytes())
    run = open_run(tmp_path / "run")
    assert list(run) == family()
    assert run.notes == ["damaged or cut off: the file ends too early; read up to there"]


def test_old_events_are_flushed_while_writing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cxbridge.trace.formats.mcap.writer._FLUSH_INTERVAL_S", -1)
    with McapWriter(tmp_path / "run") as writer:
        writer.write(family()[0])
        assert list(open_run(tmp_path / "run")) == family()[:1]


def _write_foreign(path: Path, profile: str, data: bytes) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile=profile)
        schema = writer.register_schema("cxbridge.GoalTransition", "jsonschema", b"{}")
        channel = writer.register_channel("/goals", "json", schema)
        writer.add_message(channel, 0, data, 0)
        writer.finish()
    return path


def test_mcap_file_of_another_program_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match="not a run recorded by cxbridge"):
        list(open_run(_write_foreign(tmp_path / "run", "ros2", b"{}")))


@pytest.mark.parametrize(
    "data", [b"{}", b"[]", b"\xff", b"3", b'{"time_us": "x"}', b"[" * 100_000, HUGE_TIME]
)
def test_message_that_is_no_event_is_refused(tmp_path: Path, data: bytes) -> None:
    with pytest.raises(TraceError, match="a message that is not an event"):
        list(open_run(_write_foreign(tmp_path / "run", "cxbridge", data)))


def test_compressed_file_is_read(tmp_path: Path) -> None:
    """The library compresses by default, also in the writer of foreign files above."""
    plain = json.dumps({**dict.fromkeys(event_json_schema(type(family()[0]))["required"], "a"), "time_us": 1})
    assert len(list(open_run(_write_foreign(tmp_path / "run", "cxbridge", plain.encode())))) == 1


def test_recording_loads_no_library_and_no_compressors(tmp_path: Path) -> None:
    """Loading takes longer than the recording of a whole run."""
    code = (
        "import sys; from cxbridge.trace.formats.mcap.writer import McapWriter;"
        f"McapWriter({str(tmp_path / 'run')!r}).close();"
        "assert not {'mcap', 'lz4', 'zstandard'} & set(sys.modules);"
        "import mcap, zstandard, lz4.frame"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_full_disk_is_trace_error() -> None:
    with pytest.raises(TraceError, match="cannot be written"):
        McapWriter("/dev/full")
