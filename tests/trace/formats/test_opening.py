"""A recording that a process writes is not lost to another one."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from cxbridge.errors import TraceError
from cxbridge.trace.formats.fawkes_log_writer import FawkesLogWriter
from cxbridge.trace.formats.mcap_writer import McapWriter
from cxbridge.trace.formats.opening import open_alone

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
    with open_alone(link) as file:
        file.write(b"new")
    assert path.read_bytes() == b"new"


def test_what_is_no_file_is_opened_as_usual():
    with open_alone(Path("/dev/null")) as file, open_alone(Path("/dev/null")) as other:
        assert file.write(b"x") == other.write(b"x") == 1


def test_where_there_are_no_locks_it_is_opened_as_usual(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "fcntl", None)
    path = tmp_path / "file"
    with open_alone(path) as file, open_alone(path):
        file.write(b"new")
    assert path.read_bytes() == b"new"
