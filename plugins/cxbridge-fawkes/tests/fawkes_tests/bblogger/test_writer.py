"""Files written as Fawkes' bblogger writes them: their contents, and errors that prevent writing."""

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


def make(folder: Path, scenario: str = "test") -> BBLoggerWriter:
    return BBLoggerWriter(folder, scenario, start_us=START_US, utc=True)


def block_write(number: int = 0, *, interface_id: str = "s", time_us: int = START_US) -> BlockWrite:
    return BlockWrite(time_us, f"{KIND}::{interface_id}", SCHEMA.hash, bytes([number]) * SCHEMA.datasize)


def count(path: Path) -> int:
    return int.from_bytes(path.read_bytes()[12:16], "little")


def test_what_was_written_is_read_back(tmp_path: Path) -> None:
    clock = VirtualClock(START_US)
    bus = EventBus(clock)
    told: list[object] = []
    bus.subscribe(told.append, InterfaceWrite)
    board = LocalBlackBoard(InterfaceRegistry(), clock, bus)
    with Recorder(bus, [make(tmp_path)]):
        writer = board.open_for_writing("SpeechSynthInterface", "Flite")
        for number in range(20):
            clock.sleep_until(START_US + number * 250_000)
            writer.set("text", f"Wort {number} ß")
            writer.set("duration", number / 8)
            writer.write()
    run = open_run(tmp_path)
    assert list(run) == told
    assert len(told) == 20
    assert not run.notes


# --- hashes -------------------------------------------------------------------------------------------------


def hash_in_file(folder: Path, event: BlockWrite) -> bytes:
    with make(folder) as writer:
        writer.write(event)
    (path,) = folder.glob("*.log")
    return path.read_bytes()[160:176]


@needs_shared
def test_our_definitions_have_fawkes_hash(tmp_path: Path) -> None:
    original = (SHARED / "fawkes-data" / "interfaces" / f"{KIND}.xml").read_bytes()
    fawkes_hash = md5(original, usedforsecurity=False).digest()
    assert fawkes_hash != SCHEMA.hash
    assert hash_in_file(tmp_path, block_write()) == fawkes_hash


@pytest.mark.parametrize("kind", [KIND, "NobodysInterface"])
def test_definitions_of_others_have_their_own(tmp_path: Path, kind: str) -> None:
    own = bytes(range(16))
    assert hash_in_file(tmp_path, BlockWrite(START_US, f"{kind}::x", own, bytes(24))) == own


# --- runs that end early ------------------------------------------------------------------------------------


def test_a_file_is_whole_at_any_time_and_counted_at_the_end(tmp_path: Path) -> None:
    writer = make(tmp_path)
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
    """Let no file grow beyond ``size`` bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_an_entry_that_finds_no_room_is_cut_off(tmp_path: Path) -> None:
    writer = make(tmp_path)
    writer.write(block_write(1))
    (path,) = tmp_path.iterdir()
    with disk_of(196 + ENTRY + 10), pytest.raises(TraceError, match="cannot be written") as caught:
        writer.write(block_write(2))
    assert caught.value.file == str(path)
    assert path.stat().st_size == 196 + ENTRY + 10
    writer.write(block_write(3))  # there is room again
    with disk_of(196 + 2 * ENTRY + 10), pytest.raises(TraceError):
        writer.write(block_write(4))
    writer.close()
    assert count(path) == 2
    assert path.read_bytes()[196:] == pack_entry(0, block_write(1).block) + pack_entry(
        0, block_write(3).block
    )


def test_one_file_that_fails_leaves_the_others_whole_and_the_run_going(tmp_path: Path) -> None:
    bus = EventBus(VirtualClock(START_US))
    (tmp_path / f"test-{KIND}-full-{STAMP}.log").symlink_to("/dev/full")
    with Recorder(bus, [make(tmp_path)]) as recorder:
        bus.emit(block_write(1))
        bus.emit(block_write(1, interface_id="full"))
        bus.emit(block_write(2))
    assert [error.message for error in recorder.errors] == ["cannot be written: No space left on device"]
    path = tmp_path / f"test-{KIND}-s-{STAMP}.log"
    assert (count(path), path.stat().st_size) == (1, 196 + ENTRY)


# --- the folder ---------------------------------------------------------------------------------------------


def test_a_file_in_the_place_of_the_folder_is_told(tmp_path: Path) -> None:
    (tmp_path / "f").write_text("")
    with pytest.raises(TraceError, match="this is not a folder"):
        make(tmp_path / "f")
    with pytest.raises(TraceError, match="cannot be written: Not a directory"):
        make(tmp_path / "f" / "g")


def test_a_folder_that_cannot_be_written_is_told_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.access", lambda *_: False)  # who runs the tests may be allowed everything
    with pytest.raises(TraceError, match="no file can be created in this folder"):
        make(tmp_path)
