"""Recordings that are mended: what becomes of them, and that nothing is lost on the way."""

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


def mend(path: Path) -> tuple[bytes, list[str]]:
    mending = examine(path)
    target = path.with_name("mended")
    mending.write_copy(target)
    return target.read_bytes(), mending.actions


def test_a_text_log_loses_its_half_line(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    with FawkesLogWriter(path, utc=True) as writer:
        for event in open_run(_log(tmp_path)):
            writer.write(event)
    whole = path.read_bytes()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        end = whole[:length].rfind(b"\n") + 1
        if end:
            data, actions = mend(path)
            assert data == whole[:end]
            assert bool(actions) == (end != length)
        else:
            with pytest.raises(TraceError):
                examine(path)


def _log(folder: Path) -> Path:
    path = folder / "source"
    path.write_text("I 01:00:00.000000 A: b\nW 01:00:01.000000 A: two\nlines\nD 01:00:02.000000 B: end\n")
    return path


def mcap(path: Path) -> bytes:
    with McapWriter(path) as writer:
        writer.describe({"spec": "test"})
        for number, event in enumerate(family()):
            writer.write(event)
            if number % 4 == 3:
                writer.flush()
        for number in range(3):
            writer.write(LogLine(number, next(e for e in open_run(_log(path.parent))).level, "A", "b"))  # type: ignore[attr-defined]
    return path.read_bytes()


def test_an_mcap_file_gets_its_end_back(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    whole = mcap(path)
    assert mend(path) == (whole, [])
    events = list(open_run(path))
    seen = set()
    for length in sorted(Random(5).sample(range(100, len(whole)), 60)):
        path.write_bytes(whole[:length])
        with suppress(TraceError):
            _, actions = mend(path)
            assert actions[-1].startswith("FIXING: the end of the file is missing")
            run = open_run(tmp_path / "mended")
            found = list(run)
            assert found == events[: len(found)]
            assert not run.notes
            assert run.metadata() in ({}, {"spec": "test"})
            assert not examine(tmp_path / "mended").actions
            seen.add(len(found))
    assert len(seen) > 2


def test_the_index_of_a_mended_mcap_file_is_right(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    path = tmp_path / "run.mcap"
    whole = mcap(path)
    path.write_bytes(whole[:-200])
    mend(path)
    with (tmp_path / "mended").open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == len(list(open_run(tmp_path / "mended")))


def test_a_damaged_chunk_of_an_mcap_file_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    whole = bytearray(mcap(path))
    events = list(open_run(path))
    whole[whole.find(b'"goal"')] ^= 0x55
    path.write_bytes(whole)
    _, actions = mend(path)
    assert actions == ["FIXING: 1 damaged records, left out"]
    found = list(open_run(tmp_path / "mended"))
    assert 0 < len(found) < len(events)
    assert [event for event in events if event in found] == found


@pytest.mark.parametrize(
    "content", [b"", b"hello", b"\xff\xbb\xff\xbb\x00\x00\x00\x01", b"I 01:00:00.000000 A: b"]
)
def test_what_cannot_be_mended_is_told(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(content)
    assert invoke(["trace", "repair", str(path)]) == 2
    assert path.read_bytes() == content
    assert [each.name for each in tmp_path.iterdir()] == ["a.log"]
