"""The repair of damaged recordings."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from random import Random

import pytest

from cxbridge.cli.main import invoke
from cxbridge.errors import TraceError
from cxbridge.events import LogLine
from cxbridge.trace.formats.fawkes_log import FawkesLogWriter
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from cxbridge_studio.repair.recordings import examine
from tests.trace.runs import family


def repair(path: Path) -> tuple[bytes, list[str]]:
    damage = examine(path)
    target = path.with_name("repaired")
    damage.write_copy(target)
    return target.read_bytes(), damage.actions


def test_truncated_line_of_text_log_is_removed(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    with FawkesLogWriter(path, uses_utc=True) as writer:
        for event in open_run(_write_log(tmp_path)):
            writer.write(event)
    whole = path.read_bytes()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        end = whole[:length].rfind(b"\n") + 1
        if end:
            data, actions = repair(path)
            assert data == whole[:end]
            assert bool(actions) == (end != length)
        else:
            with pytest.raises(TraceError):
                examine(path)


def _write_log(folder: Path) -> Path:
    path = folder / "source"
    path.write_text("I 01:00:00.000000 A: b\nW 01:00:01.000000 A: two\nlines\nD 01:00:02.000000 B: end\n")
    return path


def write_mcap(path: Path) -> bytes:
    with McapWriter(path) as writer:
        writer.describe({"spec": "test"})
        for number, event in enumerate(family()):
            writer.write(event)
            if number % 4 == 3:
                writer.flush()
        for number in range(3):
            writer.write(LogLine(number, next(e for e in open_run(_write_log(path.parent))).level, "A", "b"))  # type: ignore[attr-defined]
    return path.read_bytes()


def test_end_of_mcap_file_is_restored(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    whole = write_mcap(path)
    assert repair(path) == (whole, [])
    events = list(open_run(path))
    counts = set()
    for length in sorted(Random(5).sample(range(100, len(whole)), 60)):
        path.write_bytes(whole[:length])
        with suppress(TraceError):
            _, actions = repair(path)
            assert actions[-1].startswith("FIXING: the end of the file is missing")
            run = open_run(tmp_path / "repaired")
            repaired_events = list(run)
            assert repaired_events == events[: len(repaired_events)]
            assert not run.notes
            assert run.metadata() in ({}, {"spec": "test"})
            assert not examine(tmp_path / "repaired").actions
            counts.add(len(repaired_events))
    assert len(counts) > 2


def test_index_of_repaired_mcap_file_is_complete(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    path = tmp_path / "run.mcap"
    whole = write_mcap(path)
    path.write_bytes(whole[:-200])
    repair(path)
    with (tmp_path / "repaired").open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == len(list(open_run(tmp_path / "repaired")))


def test_damaged_chunk_of_mcap_file_is_omitted(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    whole = bytearray(write_mcap(path))
    events = list(open_run(path))
    whole[whole.find(b'"goal"')] ^= 0x55
    path.write_bytes(whole)
    _, actions = repair(path)
    assert actions == ["FIXING: 1 damaged records, left out"]
    repaired_events = list(open_run(tmp_path / "repaired"))
    assert 0 < len(repaired_events) < len(events)
    assert [event for event in events if event in repaired_events] == repaired_events


@pytest.mark.parametrize(
    "content", [b"", b"hello", b"\xff\xbb\xff\xbb\x00\x00\x00\x01", b"I 01:00:00.000000 A: b"]
)
def test_unrepairable_file_is_an_error_and_unchanged(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(content)
    assert invoke(["trace", "repair", str(path)]) == 2
    assert path.read_bytes() == content
    assert [each.name for each in tmp_path.iterdir()] == ["a.log"]
