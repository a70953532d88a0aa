"""Reading of bblogger's files: written, repaired by ffbblog, old, damaged and cut off."""

from __future__ import annotations

import os
import shutil
import struct
import time
import tracemalloc
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

import pytest

from cxbridge.cli.main import invoke
from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.event_kinds import View
from cxbridge.events import Event, InterfaceWrite, SkillStatus
from cxbridge.interfaces.registry import InterfaceRegistry, default_registry
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.convert import convert
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.formats.transitions_text import format_transition
from cxbridge_fawkes.bblogger.header import ENTRY_HEADER, HEADER_SIZE
from cxbridge_fawkes.bblogger.reader import RAW_FIELD, BBLoggerFile
from fawkes_tests.bblogger.bblog_files import KIND, START_S, make_file
from tests.support import many, needs_shared
from tests.trace.runs import NAMES, RECORDINGS


def read_writes(
    path: Path, registry: InterfaceRegistry | None = None
) -> tuple[list[InterfaceWrite], list[str]]:
    run = open_run(path, registry)
    events = [event for event in run if isinstance(event, InterfaceWrite)]
    return events, run.notes


@pytest.mark.parametrize("flag", [0, 1])
def test_reader_ignores_byte_order_flag(tmp_path: Path, flag: int) -> None:
    path = tmp_path / "a.log"
    values = {"text": b"hello", "msgid": 7, "final": True, "duration": 1.5}
    path.write_bytes(make_file([(1, 0), (2, START_S + 500)], flag=flag, fill=lambda _: values))
    events, notes = read_writes(path)
    assert [event.time_us // 10**6 for event in events] == [START_S + 1, START_S + 500]
    assert events[0].uid == "SpeechSynthInterface::Flite"
    assert dict(events[0].values) == {"text": "hello", "msgid": 7, "final": True, "duration": 1.5}
    assert not notes


def test_old_or_big_endian_header_is_refused(tmp_path: Path) -> None:
    """The header of 2010 has texts of 32 bytes; the second header is big-endian."""
    path = tmp_path / "a.log"
    valid = make_file([(1, 0)])
    old = valid[:64] + valid[96:128] + valid[160:]
    fields = struct.unpack_from("<II32s48s64s16sIqq", valid, 8)
    big = valid[:8] + struct.pack(">II32s48s64s16sIqq", *fields) + valid[196:]
    for data in (old, big):
        path.write_bytes(data)
        with pytest.raises(
            TraceError, match=r"(?s)not valid for a bblogger file.*before 2015-03.*big-endian"
        ):
            list(open_run(path))


def test_cut_off_entry_and_wrong_count_are_notes(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(make_file([(1, 0), (2, 0)], count=7)[:-1])
    events, notes = read_writes(path)
    assert len(events) == 1
    assert notes == ["the file ends within an entry", "the header counts 7 entries, the file has 1"]


@pytest.mark.parametrize(
    ("options", "block", "reason"),
    [
        (
            {"size": 20},
            "00000000",
            "the blocks of SpeechSynthInterface have 20 bytes, but 1056 by the definition",
        ),
        ({"kind": "OtherInterface"}, "00" * 1040, "Interface of type 'OtherInterface' not found"),
    ],
)
def test_blocks_without_definition_stay_bytes(
    tmp_path: Path, options: dict[str, Any], block: str, reason: str
) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(make_file([(1, START_S + 3)], fill=lambda _: {}, **options))
    ((event,), (note,)) = read_writes(path)
    assert event.uid == f"{options.get('kind', KIND)}::Flite"
    assert dict(event.values) == {RAW_FIELD: block}
    assert event.time_us == (START_S + 3) * 10**6
    assert note.startswith(reason)
    assert note.endswith("values are left as bytes (other definitions: --interface-dir)")


def test_reader_uses_definitions_of_interface_dir(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    definition = default_registry().path(KIND)
    assert definition is not None
    (tmp_path / "xml").mkdir()
    (tmp_path / "xml" / "OtherInterface.xml").write_text(
        definition.read_text().replace(KIND, "OtherInterface")
    )
    path = tmp_path / "a.log"
    path.write_bytes(make_file([(1, 0)], kind="OtherInterface"))
    assert invoke(["trace", "cat", str(path), "--interface-dir", str(tmp_path / "xml")]) == 0
    assert '"final":true' in capsys.readouterr().out


def test_folder_may_mix_versions_and_runs(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_bytes(make_file([(1, 10)]))
    (tmp_path / "b.log").write_bytes(make_file([(1, 20)], version=b"y" * 16))
    (tmp_path / "c.log").write_bytes(make_file([(1, 30)], size=40))
    (tmp_path / "d.log").write_bytes(make_file([(1, 40)], scenario="other"))
    (tmp_path / "e.log").write_bytes(make_file([])[:100])
    (tmp_path / "f.log").write_text("no bblogger file")
    events, notes = read_writes(tmp_path)
    assert [event.time_us // 10**6 for event in events] == [10, 20, 30, 40]
    assert [RAW_FIELD in event.values for event in events] == [False, False, True, False]
    assert [note.split(":")[0] for note in notes] == [
        "e.log",
        "files of 2 runs, by their scenarios and starts",
        "b.log",
        "c.log",
    ]


def test_folder_without_readable_file_is_error_with_reason(tmp_path: Path) -> None:
    (tmp_path / "e.log").write_bytes(make_file([])[:100])
    with pytest.raises(TraceError, match="cut off within the header"):
        list(open_run(tmp_path))


def test_reader_keeps_order_within_file_for_backward_clock(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_bytes(make_file([(1, 50), (2, 20), (3, 60)]))
    (tmp_path / "b.log").write_bytes(make_file([(1, 40), (2, 55)]))
    events, _ = read_writes(tmp_path)
    times = [event.time_us // 10**6 for event in events]
    assert [each for each in times if each in (50, 20, 60)] == [50, 20, 60]
    assert sorted(times) == [20, 40, 50, 55, 60]


def test_invalid_time_stamp_is_replaced_by_time_of_entry(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(make_file([(1, -5), (2, 1 << 60)]))
    events, _ = read_writes(path)
    assert [event.time_us // 10**6 for event in events] == [START_S + 1, START_S + 2]
    assert convert(open_run(path), tmp_path / "run.mcap", "mcap") == []


@pytest.fixture
def utc(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("TZ", "UTC")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@needs_shared
@pytest.mark.usefixtures("utc")
@pytest.mark.parametrize("name", NAMES)
def test_info_equals_output_of_ffbblog(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    for path in (RECORDINGS / name / "bblogger-repaired").glob("*.log"):
        expected = path.with_suffix(".info.txt").read_text()
        if "EXCEPTION" in expected:
            continue  # ffbblog has no output for a file without entries
        assert invoke(["trace", "info", str(path)]) == 0
        assert capsys.readouterr().out.startswith(expected)


@needs_shared
@pytest.mark.parametrize("folder", ["bblogger", "bblogger-repaired"])
@pytest.mark.parametrize("name", NAMES)
def test_skiller_statuses_equal_those_of_log(name: str, folder: str) -> None:
    events = [event for event in open_run(RECORDINGS / name / folder) if isinstance(event, SkillStatus)]
    lines = (RECORDINGS / name / "trace.txt").read_text().splitlines()
    assert [format_transition(event) for event in events] == [
        line for line in lines if line.startswith("SkillerInterface")
    ]


@needs_shared
@pytest.mark.parametrize("order", Order)
def test_both_recorded_runs_have_equal_writes(order: Order) -> None:
    """The times of blocks define the order: the times of entries are out of order between files."""
    run_a, run_b = (open_run(RECORDINGS / name / "bblogger") for name in NAMES[:2])
    comparison = compare_runs(run_a, [run_b], View.BLACKBOARD, order)
    assert comparison.same
    assert comparison.count_a == 28


def test_cut_off_file_has_complete_entries(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    data = make_file([(1, 0), (2, 0)])
    path.write_bytes(data)
    entry = ENTRY_HEADER.size + default_registry().schema(KIND).datasize
    for length in range(len(data) - 1, -1, -1):
        os.truncate(path, length)
        with suppress(TraceError):
            events, notes = read_writes(path)
            assert length >= HEADER_SIZE
            assert len(events) == (length - HEADER_SIZE) // entry
            assert bool(notes) == ((length - HEADER_SIZE) % entry != 0)
            continue
        assert length < HEADER_SIZE


@needs_shared
def test_cut_off_recording_has_first_events(tmp_path: Path) -> None:
    """Each entry of the recording has two events."""
    (source,) = (RECORDINGS / "skiller-1" / "bblogger").glob("*-SkillerInterface-*.log")
    path = tmp_path / "a.log"
    shutil.copyfile(source, path)
    complete_events: list[Event] = list(open_run(source))
    for length in sorted(Random(1).sample(range(196, source.stat().st_size), many(500, 100)), reverse=True):
        os.truncate(path, length)
        events = list(open_run(path))
        assert events == complete_events[: len(events)]
        assert len(events) == 2 * ((length - 196) // (8 + 1216))


def test_damaged_file_raises_only_cxbridge_errors(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    random = Random(2)
    valid = make_file([(1, 0), (2, 5)], count=2)
    for _ in range(many(2000, 500)):
        data = bytearray(valid)
        for _ in range(random.randint(1, 6)):
            data[random.randrange(HEADER_SIZE)] = random.randrange(256)
        path.write_bytes(data)
        with suppress(CxbridgeError):
            for event in open_run(path):
                assert event.time_us >= 0


def test_huge_file_needs_little_memory(tmp_path: Path) -> None:
    """The file has 200 MB, most of them a hole, whose entries have no time stamps."""
    path = tmp_path / "a.log"
    path.write_bytes(make_file([(1, 0)]))
    entry = ENTRY_HEADER.size + default_registry().schema(KIND).datasize
    count = 200_000_000 // entry
    os.truncate(path, HEADER_SIZE + count * entry)
    run = BBLoggerFile(path)
    tracemalloc.start()
    try:
        event_count = sum(1 for _ in zip(run, range(50_000), strict=False))
        entry_count = sum(1 for _ in run.entries())
        assert tracemalloc.get_traced_memory()[1] < 8 << 20
    finally:
        tracemalloc.stop()
    assert (event_count, entry_count) == (50_000, count)
