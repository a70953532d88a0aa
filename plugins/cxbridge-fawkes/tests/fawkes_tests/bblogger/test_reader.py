"""The files of Fawkes' bblogger, as written and as its own tool repaired them, of any age and state."""

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
from fawkes_tests.bblogger.bblog_files import KIND, START_S, make
from tests.support import many, needs_shared
from tests.trace.runs import NAMES, RECORDINGS


def writes(path: Path, registry: InterfaceRegistry | None = None) -> tuple[list[InterfaceWrite], list[str]]:
    run = open_run(path, registry)
    events = [event for event in run if isinstance(event, InterfaceWrite)]
    return events, run.notes


@pytest.mark.parametrize("flag", [0, 1])
def test_a_file_is_read_whatever_the_flag_says(tmp_path: Path, flag: int) -> None:
    path = tmp_path / "a.log"
    values = {"text": b"hello", "msgid": 7, "final": True, "duration": 1.5}
    path.write_bytes(make([(1, 0), (2, START_S + 500)], flag=flag, fill=lambda _: values))
    events, notes = writes(path)
    assert [event.time_us // 10**6 for event in events] == [START_S + 1, START_S + 500]
    assert events[0].uid == "SpeechSynthInterface::Flite"
    assert dict(events[0].values) == {"text": "hello", "msgid": 7, "final": True, "duration": 1.5}
    assert not notes


def test_a_header_of_another_age_or_byte_order_is_refused(tmp_path: Path) -> None:
    """As of 2010, with texts of 32 bytes; and of a machine with the other byte order."""
    path = tmp_path / "a.log"
    good = make([(1, 0)])
    old = good[:64] + good[96:128] + good[160:]
    fields = struct.unpack_from("<II32s48s64s16sIqq", good, 8)
    big = good[:8] + struct.pack(">II32s48s64s16sIqq", *fields) + good[196:]
    for data in (old, big):
        path.write_bytes(data)
        with pytest.raises(
            TraceError, match=r"(?s)not valid for a bblogger file.*before 2015-03.*big-endian"
        ):
            list(open_run(path))


def test_cut_off_and_wrong_counts_are_told(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(make([(1, 0), (2, 0)], count=7)[:-1])
    events, notes = writes(path)
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
def test_blocks_without_a_definition_are_left_as_bytes(
    tmp_path: Path, options: dict[str, Any], block: str, reason: str
) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(make([(1, START_S + 3)], fill=lambda _: {}, **options))
    ((event,), (note,)) = writes(path)
    assert event.uid == f"{options.get('kind', KIND)}::Flite"
    assert dict(event.values) == {RAW_FIELD: block}
    assert event.time_us == (START_S + 3) * 10**6
    assert note.startswith(reason)
    assert note.endswith("values are left as bytes (other definitions: --interface-dir)")


def test_definitions_of_an_interface_dir_are_used(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    definition = default_registry().path(KIND)
    assert definition is not None
    (tmp_path / "xml").mkdir()
    (tmp_path / "xml" / "OtherInterface.xml").write_text(
        definition.read_text().replace(KIND, "OtherInterface")
    )
    path = tmp_path / "a.log"
    path.write_bytes(make([(1, 0)], kind="OtherInterface"))
    assert invoke(["trace", "cat", str(path), "--interface-dir", str(tmp_path / "xml")]) == 0
    assert '"final":true' in capsys.readouterr().out


def test_a_folder_may_mix_versions_and_runs(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_bytes(make([(1, 10)]))
    (tmp_path / "b.log").write_bytes(make([(1, 20)], version=b"y" * 16))
    (tmp_path / "c.log").write_bytes(make([(1, 30)], size=40))
    (tmp_path / "d.log").write_bytes(make([(1, 40)], scenario="other"))
    (tmp_path / "e.log").write_bytes(make([])[:100])
    (tmp_path / "f.log").write_text("no bblogger file")
    events, notes = writes(tmp_path)
    assert [event.time_us // 10**6 for event in events] == [10, 20, 30, 40]
    assert [RAW_FIELD in event.values for event in events] == [False, False, True, False]
    assert [note.split(":")[0] for note in notes] == [
        "e.log",
        "files of 2 runs, by their scenarios and starts",
        "b.log",
        "c.log",
    ]


def test_a_folder_without_one_that_can_be_read_tells_why(tmp_path: Path) -> None:
    (tmp_path / "e.log").write_bytes(make([])[:100])
    with pytest.raises(TraceError, match="cut off within the header"):
        list(open_run(tmp_path))


def test_a_clock_that_goes_backwards_changes_no_order_within_a_file(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_bytes(make([(1, 50), (2, 20), (3, 60)]))
    (tmp_path / "b.log").write_bytes(make([(1, 40), (2, 55)]))
    events, _ = writes(tmp_path)
    times = [event.time_us // 10**6 for event in events]
    assert [each for each in times if each in (50, 20, 60)] == [50, 20, 60]
    assert sorted(times) == [20, 40, 50, 55, 60]


def test_stamps_that_are_no_time_give_way_to_the_loggers(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(make([(1, -5), (2, 1 << 60)]))
    events, _ = writes(path)
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
def test_info_is_what_ffbblog_printed(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    for path in (RECORDINGS / name / "bblogger-repaired").glob("*.log"):
        expected = path.with_suffix(".info.txt").read_text()
        if "EXCEPTION" in expected:
            continue  # ffbblog has nothing to say of a file without entries
        assert invoke(["trace", "info", str(path)]) == 0
        assert capsys.readouterr().out.startswith(expected)


@needs_shared
@pytest.mark.parametrize("folder", ["bblogger", "bblogger-repaired"])
@pytest.mark.parametrize("name", NAMES)
def test_the_skiller_says_what_the_log_says(name: str, folder: str) -> None:
    events = [event for event in open_run(RECORDINGS / name / folder) if isinstance(event, SkillStatus)]
    lines = (RECORDINGS / name / "trace.txt").read_text().splitlines()
    assert [format_transition(event) for event in events] == [
        line for line in lines if line.startswith("SkillerInterface")
    ]


@needs_shared
@pytest.mark.parametrize("order", Order)
def test_both_runs_of_the_skiller_wrote_the_same(order: Order) -> None:
    """As told by the blocks' own times: the times of the entries are out of order between files."""
    one, other = (open_run(RECORDINGS / name / "bblogger") for name in NAMES[:2])
    comparison = compare_runs(one, [other], View.BLACKBOARD, order)
    assert comparison.same
    assert comparison.count_a == 28


def test_a_file_cut_off_anywhere_has_its_whole_entries(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    data = make([(1, 0), (2, 0)])
    path.write_bytes(data)
    entry = ENTRY_HEADER.size + default_registry().schema(KIND).datasize
    for length in range(len(data) - 1, -1, -1):
        os.truncate(path, length)
        with suppress(TraceError):
            events, notes = writes(path)
            assert length >= HEADER_SIZE
            assert len(events) == (length - HEADER_SIZE) // entry
            assert bool(notes) == ((length - HEADER_SIZE) % entry != 0)
            continue
        assert length < HEADER_SIZE


@needs_shared
def test_recordings_cut_off_anywhere(tmp_path: Path) -> None:
    """The rest of a recording are its first events."""
    (source,) = (RECORDINGS / "skiller-1" / "bblogger").glob("*-SkillerInterface-*.log")
    path = tmp_path / "a.log"
    shutil.copyfile(source, path)
    whole: list[Event] = list(open_run(source))
    for length in sorted(Random(1).sample(range(196, source.stat().st_size), many(500, 100)), reverse=True):
        os.truncate(path, length)
        events = list(open_run(path))
        assert events == whole[: len(events)]
        assert len(events) == 2 * ((length - 196) // (8 + 1216))


def test_damaged_files_give_our_errors_only(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    random = Random(2)
    good = make([(1, 0), (2, 5)], count=2)
    for _ in range(many(2000, 500)):
        data = bytearray(good)
        for _ in range(random.randint(1, 6)):
            data[random.randrange(HEADER_SIZE)] = random.randrange(256)
        path.write_bytes(data)
        with suppress(CxbridgeError):
            for event in open_run(path):
                assert event.time_us >= 0


def test_a_huge_file_is_read_in_bounded_memory(tmp_path: Path) -> None:
    """Of 200 MB, most of them a hole; the entries of the hole have no stamps but the start."""
    path = tmp_path / "a.log"
    path.write_bytes(make([(1, 0)]))
    entry = ENTRY_HEADER.size + default_registry().schema(KIND).datasize
    count = 200_000_000 // entry
    os.truncate(path, HEADER_SIZE + count * entry)
    run = BBLoggerFile(path)
    tracemalloc.start()
    try:
        seen = sum(1 for _ in zip(run, range(50_000), strict=False))
        read = sum(1 for _ in run.entries())
        assert tracemalloc.get_traced_memory()[1] < 8 << 20
    finally:
        tracemalloc.stop()
    assert (seen, read) == (50_000, count)
