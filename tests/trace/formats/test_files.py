"""A recording that a process writes is not lost to another one."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from cxbridge.errors import TraceError
from cxbridge.trace.formats.fawkes_log import FawkesLogWriter
from cxbridge.trace.formats.files import open_exclusively, rename_previous
from cxbridge.trace.formats.mcap.writer import McapWriter

pytest.importorskip("fcntl")


@pytest.mark.parametrize("writer", [McapWriter, FawkesLogWriter])
def test_a_file_that_is_being_written_stays_as_it_is(tmp_path, writer):
    """A daemon that was started a second time by mistake cut off the recording of the first."""
    path = tmp_path / "run"
    with writer(path):
        before = path.read_bytes()
        with pytest.raises(TraceError, match="another process is writing this file"):
            writer(path)
        assert path.read_bytes() == before
    with writer(path):  # again when the other is done
        pass


def test_it_is_empty_afterwards_and_a_link_is_followed(tmp_path):
    path, link = tmp_path / "file", tmp_path / "link"
    path.write_bytes(b"what was there before")
    link.symlink_to(path)
    with open_exclusively(link) as file:
        file.write(b"new")
    assert path.read_bytes() == b"new"


def test_what_is_there_is_kept_under_the_time_of_its_last_change(tmp_path):
    path, stamp = tmp_path / "run.mcap", 1_700_000_000
    names = []
    for text in ("first", "second"):
        path.write_text(text)
        os.utime(path, (stamp, stamp))
        kept = rename_previous(path)
        assert kept is not None
        assert not path.exists()
        assert kept.read_text() == text
        names.append(kept.name)
    first = time.strftime("run-%Y-%m-%d-%H-%M-%S.mcap", time.localtime(stamp))
    assert names == [first, first.replace(".mcap", "-2.mcap")]


def test_what_is_empty_no_file_a_link_or_being_written_is_not_renamed(tmp_path):
    empty, link, busy = tmp_path / "empty", tmp_path / "link", tmp_path / "busy"
    empty.touch()
    link.symlink_to(busy)
    with open_exclusively(busy) as file:
        file.write(b"x")
        file.flush()
        for path in (empty, link, busy, tmp_path / "none", tmp_path, Path("/dev/null")):
            assert rename_previous(path) is None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["busy", "empty", "link"]
