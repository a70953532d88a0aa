"""Headers, entries and names of bblogger's files."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.interfaces.registry import default_registry
from cxbridge_fawkes.bblogger.header import (
    ENTRY_HEADER,
    HEADER_SIZE,
    file_name,
    pack_entry,
    pack_header,
    read_header,
)
from tests.support import needs_shared
from tests.trace.runs import NAMES, RECORDINGS

START_US = 1_000_000_000_250_000
little_endian = pytest.mark.skipif(sys.byteorder != "little", reason="the expected bytes are little endian")
names = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=80)


@little_endian
def test_header_has_fawkes_bytes() -> None:
    data = pack_header(
        "kitchen", "SkillerInterface::Skiller", bytes(range(16)), 1216, start_us=START_US, count=258
    )
    assert data == b"".join(
        (
            b"\xff\xbb\xff\xbb",
            b"\x00\x00\x00\x01",
            b"\x00\x00\x00\x00",  # little endian
            b"\x02\x01\x00\x00",  # 258 entries
            b"kitchen" + b"\0" * 25,
            b"SkillerInterface" + b"\0" * 32,
            b"Skiller" + b"\0" * 57,
            b"\x00\x01\x02\x03\x04\x05\x06\x07\x08\x09\x0a\x0b\x0c\x0d\x0e\x0f",
            b"\xc0\x04\x00\x00",
            b"\x00\xca\x9a\x3b\x00\x00\x00\x00",  # 1 000 000 000 s
            b"\x90\xd0\x03\x00\x00\x00\x00\x00",  # 250 000 us
        )
    )
    assert len(data) == HEADER_SIZE == 196


@little_endian
def test_entry_has_fawkes_bytes() -> None:
    assert pack_entry(3_000_515, b"block") == b"\x03\x00\x00\x00\x03\x02\x00\x00block"
    assert ENTRY_HEADER.size == 8


def test_entry_time_wraps_at_32_bits() -> None:
    """A virtual clock may jump over more than 136 years, which must not end a run."""
    assert struct.unpack("=II", pack_entry((2**32 + 7) * 10**6 + 1, b"")) == (7, 1)


@needs_shared
@little_endian
@pytest.mark.parametrize("name", NAMES)
def test_headers_equal_those_repaired_by_ffbblog(name: str) -> None:
    paths = sorted((RECORDINGS / name / "bblogger-repaired").glob("*.log"))
    assert len(paths) == 3
    for path in paths:
        recorded = path.read_bytes()[:HEADER_SIZE]
        header = read_header(recorded, path, default_registry())
        assert header.schema is not None
        version, size = recorded[160:176], header.schema.datasize
        assert recorded == pack_header(
            header.scenario, header.uid, version, size, start_us=header.start_us, count=header.count
        )
        assert path.stat().st_size == HEADER_SIZE + header.count * (ENTRY_HEADER.size + size)


@given(names, names.filter(bool), st.integers(0, 2**62), st.integers(0, 2**32 - 1))
def test_read_header_returns_packed_values(
    scenario: str, interface_id: str, start_us: int, count: int
) -> None:
    schema = default_registry().schema("SkillerInterface")
    uid = f"SkillerInterface::{interface_id}"
    data = pack_header(scenario, uid, schema.hash, schema.datasize, start_us=start_us, count=count)
    header = read_header(data, Path("a.log"), default_registry())
    assert (header.count, header.start_us, header.schema) == (count, start_us, schema)
    for name, kept, size in (
        (scenario, header.scenario, 32),
        (uid, header.uid, 64 + len("SkillerInterface::")),
    ):
        assert name.startswith(kept)
        rest = name[len(kept) :]
        assert not rest or len((kept + rest[0]).encode()) >= size  # as little as possible is lost


def test_header_does_not_split_characters() -> None:
    data = pack_header("a" * 30 + "é", "AInterface::" + "é" * 40, bytes(16), 16, start_us=0)
    assert data[16:48] == b"a" * 30 + b"\0\0"
    assert data[96:160] == "é".encode() * 31 + b"\0\0"


@pytest.mark.parametrize(
    ("scenario", "uid", "name"),
    [
        ("test", "SkillerInterface::Skiller", "test-SkillerInterface-Skiller"),
        ("a b", "AInterface::/cam/1 *?[x]", "a%20b-AInterface-%2Fcam%2F1%20%2A%3F%5Bx%5D"),
        ("x/../y", "AInterface::B::c", "x%2F..%2Fy-AInterface-B%3A%3Ac"),
        ("größe", "AInterface::100%", "gr%C3%B6%C3%9Fe-AInterface-100%25"),
    ],
)
def test_file_name_escapes_scenario_and_uid(scenario: str, uid: str, name: str) -> None:
    assert file_name(scenario, uid, START_US, utc=True) == f"{name}-2001-09-09-01-46-40.log"


def test_file_name_has_local_time(monkeypatch: pytest.MonkeyPatch) -> None:
    import time

    with monkeypatch.context() as patch:
        patch.setenv("TZ", "UTC-05:30")
        time.tzset()
        local = file_name("t", "AInterface::a", START_US)
    time.tzset()
    assert local == "t-AInterface-a-2001-09-09-07-16-40.log"


@given(names.filter(bool), names.filter(bool))
def test_file_names_differ_by_id_and_stay_in_folder(id_a: str, id_b: str) -> None:
    first, second = (file_name("t", f"AInterface::{name}", 0, utc=True) for name in (id_a, id_b))
    assert (first == second) == (id_a == id_b)
    assert Path("folder", first).parent == Path("folder")
    assert first.isascii()
    assert not set(first) & set(" /\\*?[]:'\"$`\n")
