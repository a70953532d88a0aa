"""Mcap files that are truncated, damaged, of another version, or huge; table: docs/evidence/proofs.md."""

from __future__ import annotations

import struct
import tracemalloc
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.errors import TraceError
from cxbridge.events import Event, Level, LogLine, SourceRead
from cxbridge.trace.formats.mcap import records as mcap
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.listing import event_filter, text_lines
from cxbridge.trace.summary import summarise
from tests.support import many
from tests.trace.runs import goal

EVENTS = [goal(f"gen{i}", "FORMULATED", time_us=i) for i in range(15)]
TEMPORARY = settings(max_examples=many(150, 37), deadline=None)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, Path]:
    """Return the bytes of a file with three chunks and attachments, and a path for changed copies."""
    path = tmp_path_factory.mktemp("mcap") / "run"
    return write_three_chunks(path), path


def write_three_chunks(path: Path) -> bytes:
    """Write a file with three chunks and attachments; return its bytes."""
    with McapWriter(path) as writer:
        writer.describe({"spec": "test"})
        for number, event in enumerate(EVENTS):
            writer.write(event)
            if number % 5 == 4:
                writer.flush()
                writer.write(SourceRead(number, "pddl", "", f"{number}.pddl", b"x" * number, {}))
    return path.read_bytes()


def read(path: Path, content: bytes) -> list[Event]:
    """Return the events of a file, none if the file is refused."""
    path.write_bytes(content)
    try:
        return list(open_run(path))
    except TraceError:
        return []


def messages_before(content: bytes, end: int) -> int:
    """Return the number of complete messages before an offset, by the records of the file."""
    count, at = 0, len(mcap.MAGIC)
    inside = -1
    while at + mcap.HEAD.size <= end:
        kind, size = mcap.HEAD.unpack_from(content, at)
        if kind == mcap.CHUNK and inside < at:
            inside = at + mcap.HEAD.size + size
            at += mcap.HEAD.size + 8 * 3 + 4 + 4 + 8  # the records of an uncompressed chunk
            continue
        at += mcap.HEAD.size + size
        count += kind == mcap.MESSAGE and at <= end
    return count


def test_truncated_file_has_events_before_cut(recorded: tuple[bytes, Path]) -> None:
    content, path = recorded
    count = 0
    for end in sorted({*range(0, len(content), many(1, 29)), len(content) - 1}):
        events = read(path, content[:end])
        assert events == EVENTS[: len(events)]
        assert len(events) == messages_before(content, end), end
        assert len(events) >= count
        count = len(events)
    assert count == len(EVENTS)


def test_truncated_file_has_note_and_attachments(recorded: tuple[bytes, Path]) -> None:
    content, path = recorded
    path.write_bytes(content[: len(content) * 2 // 3])
    run = open_run(path)
    summary = summarise(run)
    assert summary.notes == ["damaged or cut off: the file ends too early; read up to there"]
    assert summary.metadata == {"spec": "test"}
    assert list(summary.attachments) == ["pddl/4.pddl", "pddl/9.pddl"]


@TEMPORARY
@given(st.data())
def test_flipped_bits_never_change_events(recorded: tuple[bytes, Path], data: st.DataObject) -> None:
    content, path = recorded
    at = data.draw(st.integers(0, len(content) - 1))
    flipped = bytes([content[at] ^ (1 << data.draw(st.integers(0, 7)))])
    events = read(path, content[:at] + flipped + content[at + 1 :])
    assert events == EVENTS[: len(events)]


@TEMPORARY
@given(st.binary(max_size=300))
def test_junk_after_magic_has_no_events(recorded: tuple[bytes, Path], junk: bytes) -> None:
    _, path = recorded
    assert read(path, mcap.MAGIC + junk) == []


def message(data: bytes) -> bytes:
    return mcap.HEAD.pack(mcap.MESSAGE, 22 + len(data)) + struct.pack("<HIQQ", 1, 0, 0, 0) + data


def block(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def write_foreign(path: Path, *more: bytes) -> Path:
    """Write records after the schema and channel of a file without an end."""
    with path.open("wb") as file:
        header = block(b"cxbridge") + block(b"another")
        file.write(mcap.MAGIC + mcap.HEAD.pack(mcap.HEADER, len(header)) + header)
        schema = struct.pack("<H", 1) + block(b"cxbridge.LogLine") + block(b"jsonschema") + block(b"{}")
        channel = struct.pack("<HH", 1, 1) + block(b"/log") + block(b"json") + block(b"")
        for kind, record in ((mcap.SCHEMA, schema), (mcap.CHANNEL, channel)):
            file.write(mcap.HEAD.pack(kind, len(record)) + record)
        for record in more:
            file.write(record)
    return path


LINE = b'{"time_us":%d,"level":"I","component":"a","text":"b"'


def test_fields_and_kinds_of_later_versions_are_ignored(tmp_path: Path) -> None:
    """A later version has an additional field, an unknown kind of record, and a new kind of event."""
    unknown = mcap.HEAD.pack(0x7F, 3) + b"abc"
    schema = struct.pack("<H", 2) + block(b"cxbridge.Later") + block(b"jsonschema") + block(b"{}")
    channel = struct.pack("<HH", 2, 2) + block(b"/later") + block(b"json") + block(b"")
    later = message(b'{"what":1}').replace(struct.pack("<HI", 1, 0), struct.pack("<HI", 2, 0), 1)
    path = write_foreign(
        tmp_path / "run",
        mcap.HEAD.pack(mcap.SCHEMA, len(schema)) + schema,
        mcap.HEAD.pack(mcap.CHANNEL, len(channel)) + channel,
        unknown,
        later,
        message(LINE % 1 + b',"more":[1]}'),
    )
    run = open_run(path)
    assert [event.time_us for event in run] == [1]
    assert run.notes == [
        "damaged or cut off: the file ends too early; read up to there"
    ]  # the file has no footer


def test_message_of_earlier_version_is_error(tmp_path: Path) -> None:
    path = write_foreign(tmp_path / "run", message(b'{"time_us":1,"level":"I","component":"a"}'))
    with pytest.raises(TraceError, match=r"a message that is not an event of kind .*text") as caught:
        list(open_run(path))
    assert "another version" in str(caught.value)


def test_backward_clock_keeps_order_of_file(tmp_path: Path) -> None:
    events = [goal("gen1", "FORMULATED", time_us=time_us) for time_us in (5_000_000, 1_000_000, 3_000_000)]
    with McapWriter(tmp_path / "run") as writer:
        for event in events:
            writer.write(event)
    run = open_run(tmp_path / "run")
    assert list(run) == events
    assert summarise(run).seconds == 4
    seconds = [line.split()[0] for line in text_lines(run, event_filter([], ""))]
    assert seconds == ["0.000000", "-4.000000", "-2.000000"]


@pytest.mark.parametrize("packing", ["zstd", "lz4"])
def test_compressed_chunk_larger_than_declared_is_refused(packing: str, tmp_path: Path) -> None:
    import lz4.frame
    import zstandard

    bomb = message(LINE % 1 + b"}") + b"\0" * (64 << 20)
    packed = zstandard.compress(bomb) if packing == "zstd" else lz4.frame.compress(bomb)
    head = struct.pack("<QQQI", 0, 0, 1000, 0) + block(packing.encode()) + struct.pack("<Q", len(packed))
    path = write_foreign(
        tmp_path / "run", mcap.HEAD.pack(mcap.CHUNK, len(head) + len(packed)) + head + packed
    )
    tracemalloc.start()
    try:
        with pytest.raises(TraceError, match="damaged or cut off before the first event"):
            list(open_run(path))
        assert tracemalloc.get_traced_memory()[1] < 8 << 20
    finally:
        tracemalloc.stop()


def lines(count: int) -> Iterator[LogLine]:
    for number in range(count):
        yield LogLine(number, Level.INFO, "component", "x" * 400)


def test_memory_does_not_grow_with_file(tmp_path: Path) -> None:
    """Writes and reads 20 MB; a manual check with 300 MB had the same bounds (docs/evidence/proofs.md)."""
    path = tmp_path / "run"
    tracemalloc.start()
    try:
        with McapWriter(path) as writer:
            for event in lines(40_000):
                writer.write(event)
        assert sum(1 for _ in open_run(path)) == 40_000
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert path.stat().st_size > 18_000_000
    assert peak < 6 << 20


def test_wrong_length_is_never_trusted(recorded: tuple[bytes, Path]) -> None:
    """The length 2^63-1 of a channel record caused a traceback."""
    content, path = recorded
    for damaged in wrong_lengths(content):
        path.write_bytes(damaged)
        read_all(path)


def wrong_lengths(content: bytes) -> Iterator[bytes]:
    """Yield copies of a file with a large number at each position."""
    for size, lengths in ((8, (2**63 - 1, 2**64 - 1)), (4, (2**32 - 1,))):
        for at in range(len(mcap.MAGIC), len(content) - size, many(1, 61)):
            for length in lengths:
                yield content[:at] + length.to_bytes(size, "little") + content[at + size :]


def wrong_record_lengths(content: bytes) -> Iterator[bytes]:
    """Yield copies of a file with a too large record length."""
    heads, at = [], len(mcap.MAGIC)
    while at < len(content) - len(mcap.MAGIC):
        kind, size = mcap.HEAD.unpack_from(content, at)
        heads.append(at + 1)
        at += mcap.HEAD.size + (8 * 3 + 4 + 4 + 8 if kind == mcap.CHUNK else size)
    assert len(heads) > 40
    for head in heads:
        for length in (2**63 - 1, 2**64 - 1, 2**63, len(content)):
            yield content[:head] + length.to_bytes(8, "little") + content[head + 8 :]


def read_all(path: Path) -> None:
    """Read a file in all ways; only TraceErrors are accepted."""
    for work in (
        lambda: list(open_run(path)),
        lambda: open_run(path).metadata(),
        lambda: list(open_run(path).source_records()),
        lambda: [file.read() for file in open_run(path).files()],
        lambda: summarise(open_run(path)),
    ):
        with suppress(TraceError):
            work()
