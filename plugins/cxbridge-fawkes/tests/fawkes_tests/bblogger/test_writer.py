"""Files of `BBLoggerWriter`: contents, hashes, early ends and errors."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import md5
from pathlib import Path

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.errors import TraceError
from cxbridge.events import BlockWrite, EventBus, InterfaceWrite
from cxbridge.interfaces.registry import InterfaceRegistry, default_registry
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.recorder import Recorder
from cxbridge_fawkes.bblogger.header import pack_entry
from cxbridge_fawkes.bblogger.writer import BBLoggerWriter
from tests.support import SHARED, needs_shared

START_US = 1_000_000_000_000_000
STAMP = "2001-09-09-01-46-40"
KIND = "SwitchInterface"
SCHEMA = default_registry().schema(KIND)
ENTRY = 8 + SCHEMA.datasize


def make_writer(folder: Path, scenario: str = "test") -> BBLoggerWriter:
    return BBLoggerWriter(folder, scenario, start_us=START_US, utc=True)


def block_write(number: int = 0, *, interface_id: str = "s", time_us: int = START_US) -> BlockWrite:
    return BlockWrite(time_us, f"{KIND}::{interface_id}", SCHEMA.hash, bytes([number]) * SCHEMA.datasize)


def count(path: Path) -> int:
    return int.from_bytes(path.read_bytes()[12:16], "little")


def test_reader_returns_written_events(tmp_path: Path) -> None:
    clock = VirtualClock(START_US)
    bus = EventBus(clock)
    events: list[object] = []
    bus.subscribe(events.append, InterfaceWrite)
    board = LocalBlackBoard(InterfaceRegistry(), clock, bus)
    with Recorder(bus, [make_writer(tmp_path)]):
        writer = board.open_for_writing("SpeechSynthInterface", "Flite")
        for number in range(20):
            clock.sleep_until(START_US + number * 250_000)
            writer.set("text", f"Wort {number} ß")
            writer.set("duration", number / 8)
            writer.write()
    run = open_run(tmp_path)
    assert list(run) == events
    assert len(events) == 20
    assert not run.notes


# --- hashes -------------------------------------------------------------------------------------------------


def hash_in_file(folder: Path, event: BlockWrite) -> bytes:
    with make_writer(folder) as writer:
        writer.write(event)
    (path,) = folder.glob("*.log")
    return path.read_bytes()[160:176]


@needs_shared
def test_shipped_definitions_have_fawkes_hash(tmp_path: Path) -> None:
    original = (SHARED / "fawkes-data" / "interfaces" / f"{KIND}.xml").read_bytes()
    fawkes_hash = md5(original, usedforsecurity=False).digest()
    assert fawkes_hash != SCHEMA.hash
    assert hash_in_file(tmp_path, block_write()) == fawkes_hash


@pytest.mark.parametrize("kind", [KIND, "UnknownInterface"])
def test_custom_definitions_have_own_hash(tmp_path: Path, kind: str) -> None:
    own = bytes(range(16))
    assert hash_in_file(tmp_path, BlockWrite(START_US, f"{kind}::x", own, bytes(24))) == own


# --- runs that end early ------------------------------------------------------------------------------------


def test_file_is_always_complete_and_counted_at_end(tmp_path: Path) -> None:
    writer = make_writer(tmp_path)
    for number in range(1, 4):
        writer.write(block_write(number))
        (path,) = tmp_path.iterdir()
        assert path.stat().st_size == 196 + number * ENTRY
        assert count(path) == 0
        run = open_run(path)
        assert len(list(run)) == number
        assert not run.notes
    writer.flush()
    writer.close()
    writer.close()
    assert count(path) == 3
    assert path.stat().st_size == 196 + 3 * ENTRY


@contextmanager
def disk_of(size: int) -> Iterator[None]:
    """Limit files to ``size`` bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_entry_on_full_disk_is_cut_off_and_overwritten(tmp_path: Path) -> None:
    writer = make_writer(tmp_path)
    writer.write(block_write(1))
    (path,) = tmp_path.iterdir()
    with disk_of(196 + ENTRY + 10), pytest.raises(TraceError, match="cannot be written") as caught:
        writer.write(block_write(2))
    assert caught.value.file == str(path)
    assert path.stat().st_size == 196 + ENTRY + 10
    writer.write(block_write(3))  # the disk has space again
    with disk_of(196 + 2 * ENTRY + 10), pytest.raises(TraceError):
        writer.write(block_write(4))
    writer.close()
    assert count(path) == 2
    assert path.read_bytes()[196:] == pack_entry(0, block_write(1).block) + pack_entry(
        0, block_write(3).block
    )


def test_failed_file_affects_neither_second_file_nor_run(tmp_path: Path) -> None:
    bus = EventBus(VirtualClock(START_US))
    (tmp_path / f"test-{KIND}-full-{STAMP}.log").symlink_to("/dev/full")
    with Recorder(bus, [make_writer(tmp_path)]) as recorder:
        bus.emit(block_write(1))
        bus.emit(block_write(1, interface_id="full"))
        bus.emit(block_write(2))
    assert [error.message for error in recorder.errors] == ["cannot be written: No space left on device"]
    path = tmp_path / f"test-{KIND}-s-{STAMP}.log"
    assert (count(path), path.stat().st_size) == (1, 196 + ENTRY)


# --- the folder ---------------------------------------------------------------------------------------------


def test_file_instead_of_folder_is_error(tmp_path: Path) -> None:
    (tmp_path / "f").write_text("")
    with pytest.raises(TraceError, match="this is not a folder"):
        make_writer(tmp_path / "f")
    with pytest.raises(TraceError, match="cannot be written: Not a directory"):
        make_writer(tmp_path / "f" / "g")


def test_read_only_folder_is_error_at_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.access", lambda *_: False)  # root may write everywhere
    with pytest.raises(TraceError, match="no file can be created in this folder"):
        make_writer(tmp_path)
