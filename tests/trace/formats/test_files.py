"""Recordings are protected from other processes."""

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
def test_file_being_written_is_not_changed(tmp_path, writer):
    """The accidental second start of a daemon truncated the recording of the first daemon."""
    path = tmp_path / "run"
    with writer(path):
        before = path.read_bytes()
        with pytest.raises(TraceError, match="another process is writing this file"):
            writer(path)
        assert path.read_bytes() == before
    with writer(path):  # the first writer is closed
        pass


def test_exclusive_file_is_emptied_through_link(tmp_path):
    path, link = tmp_path / "file", tmp_path / "link"
    path.write_bytes(b"earlier content")
    link.symlink_to(path)
    with open_exclusively(link) as file:
        file.write(b"new")
    assert path.read_bytes() == b"new"


def test_previous_file_is_kept_under_its_time(tmp_path):
    path, stamp = tmp_path / "run.mcap", 1_700_000_000
    names = []
    for text in ("first", "second"):
        path.write_text(text)
        os.utime(path, (stamp, stamp))
        renamed = rename_previous(path)
        assert renamed is not None
        assert not path.exists()
        assert renamed.read_text() == text
        names.append(renamed.name)
    first = time.strftime("run-%Y-%m-%d-%H-%M-%S.mcap", time.localtime(stamp))
    assert names == [first, first.replace(".mcap", "-2.mcap")]


def test_empty_file_link_and_file_being_written_are_not_renamed(tmp_path):
    empty, link, busy = tmp_path / "empty", tmp_path / "link", tmp_path / "busy"
    empty.touch()
    link.symlink_to(busy)
    with open_exclusively(busy) as file:
        file.write(b"x")
        file.flush()
        for path in (empty, link, busy, tmp_path / "none", tmp_path, Path("/dev/null")):
            assert rename_previous(path) is None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["busy", "empty", "link"]
