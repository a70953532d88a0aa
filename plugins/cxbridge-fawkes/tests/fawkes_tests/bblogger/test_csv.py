"""CSV files equal those of ffbblog."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from cxbridge.errors import TraceError
from cxbridge.events import InterfaceWrite
from cxbridge.interfaces.registry import default_registry
from cxbridge.trace.convert import convert
from cxbridge.trace.formats.registry import open_run
from cxbridge_fawkes.csv.writer import format_heading, make_formatter
from fawkes_tests.bblogger.bblog_files import KIND, START_S, make_file
from tests.support import needs_shared
from tests.trace.runs import NAMES, RECORDINGS, MemoryRun

NAME = f"test-{KIND}-Flite-2014-05-13-16-53-20.csv"
HEADING = format_heading(default_registry().schema(KIND))


def recordings() -> Iterator[Path]:
    """Yield the recorded files with entries: ffbblog cannot convert an empty file."""
    for name in NAMES:
        for path in sorted((RECORDINGS / name / "bblogger").glob("*.log")):
            if (RECORDINGS / name / "bblogger-repaired" / path.name).with_suffix(".csv").stat().st_size:
                yield path


@needs_shared
def test_recordings_convert_as_with_ffbblog(tmp_path: Path) -> None:
    paths = list(recordings())
    assert len(paths) == 7
    for path in paths:
        expected = (path.parent.parent / "bblogger-repaired" / path.name).with_suffix(".csv")
        for source in (path, expected.with_suffix(".log")):
            assert convert(open_run(source), tmp_path / "out.csv", "csv") == []
            assert (tmp_path / "out.csv").read_bytes() == expected.read_bytes()


@needs_shared
def test_folder_is_converted_to_folder(tmp_path: Path) -> None:
    source = RECORDINGS / "skiller-1" / "bblogger"
    assert convert(open_run(source), tmp_path / "out", "csv") == []
    names = sorted(path.stem for path in (tmp_path / "out").iterdir())
    assert names == sorted(path.stem for path in source.iterdir())


def test_run_without_bblogger_files_is_converted(tmp_path: Path) -> None:
    events = [
        InterfaceWrite(
            START_S * 10**6 + step,
            f"{KIND}::a/b",
            {"text": "x;y", "msgid": step, "final": False, "duration": 0.5},
        )
        for step in range(3)
    ]
    unknown = InterfaceWrite(START_S * 10**6, "OtherInterface::x", {"a": 1})
    run = MemoryRun([*events, unknown])
    notes = convert(run, tmp_path / "out", "csv")
    assert [note.split(".")[0] for note in notes] == [
        "OtherInterface::x: left out: Interface of type 'OtherInterface' not found"
    ]
    (path,) = (tmp_path / "out").iterdir()
    assert path.name.startswith(f"run-{KIND}-a%2Fb-")
    rows = [f"{step / 1e6:f};x;y;{step};false;0.500000" for step in range(3)]
    assert path.read_text().splitlines() == [HEADING, *rows]


def test_single_file_for_several_interfaces_is_refused(tmp_path: Path) -> None:
    values = {"text": "", "msgid": 0, "final": False, "duration": 0.0}
    run = MemoryRun([InterfaceWrite(1, f"{KIND}::{each}", values) for each in "ab"])
    with pytest.raises(TraceError, match="several interfaces"):
        convert(run, tmp_path / "out.csv", "csv")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_full_disk_is_trace_error(tmp_path: Path) -> None:
    (tmp_path / "full.csv").symlink_to("/dev/full")
    (tmp_path / "a.log").write_bytes(make_file([(1, 0)]))
    values = {"text": "", "msgid": 0, "final": False, "duration": 0.0}
    for run in (open_run(tmp_path / "a.log"), MemoryRun([InterfaceWrite(1, f"{KIND}::a", values)])):
        with pytest.raises(TraceError, match="cannot be written"):
            convert(run, tmp_path / "full.csv", "csv")


def test_conversion_keeps_bytes_of_text(tmp_path: Path) -> None:
    """As in C, invalid UTF-8 stays, an unknown item is a word, and a NaN has a name."""
    (tmp_path / "a.log").write_bytes(
        make_file([(1, 0)], fill=lambda _: {"text": b"\xff;\n", "duration": -math.nan})
    )
    convert(open_run(tmp_path / "a.log"), tmp_path / "a.csv", "csv")
    assert (tmp_path / "a.csv").read_bytes() == f"{HEADING}\n".encode() + b"1.000000;\xff;\n;0;false;-nan\n"
    assert make_formatter("SomeEnum")(7) == "UNKNOWN"
    assert make_formatter("double")(math.inf) == "inf"
