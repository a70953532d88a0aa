"""Copies of runs in other formats."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.trace.convert import convert
from cxbridge.trace.formats.registry import copy_formats, open_run
from tests.support import needs_shared
from tests.trace.runs import NAMES, RECORDINGS, MemoryRun, family, recording


@needs_shared
@pytest.mark.parametrize("name", NAMES)
def test_recording_is_unchanged_by_conversion_to_mcap(name: str, tmp_path: Path) -> None:
    assert convert(open_run(recording(name)), tmp_path / "run.mcap", "mcap") == []
    copy = open_run(tmp_path / "run.mcap")
    assert list(copy) == list(open_run(recording(name)))
    assert convert(copy, tmp_path / "run.log", "fawkes-log") == []
    assert (tmp_path / "run.log").read_bytes() == recording(name).read_bytes()
    assert convert(copy, tmp_path / "run.txt", "transitions") == []
    assert (tmp_path / "run.txt").read_bytes() == (RECORDINGS / name / "trace.txt").read_bytes()


def test_events_without_place_in_log_have_notes(tmp_path: Path) -> None:
    notes = convert(MemoryRun(family()), tmp_path / "run.log", "fawkes-log")
    assert notes == [
        "fawkes-log can store nothing of the run: the copy is empty",
        "18 transitions cannot be stored as fawkes-log: the run was recorded without facts",
    ]


@pytest.mark.parametrize("to", copy_formats())
def test_copy_to_impossible_path_is_error(to: str, tmp_path: Path) -> None:
    (tmp_path / "missing").touch()
    with pytest.raises(CxbridgeError, match="cannot be written"):
        convert(MemoryRun(family()), tmp_path / "missing" / "run", to)


@pytest.mark.parametrize("to", sorted({*copy_formats()} - {"csv"}))  # csv has a separate test
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_full_disk_is_error(to: str, tmp_path: Path) -> None:
    source = tmp_path / "run"
    source.write_text("I 01:00:00.000000 A: b\n")
    events = [*open_run(source), *family()]
    with pytest.raises(CxbridgeError, match="cannot be written"):
        convert(MemoryRun(events), Path("/dev/full"), to)
