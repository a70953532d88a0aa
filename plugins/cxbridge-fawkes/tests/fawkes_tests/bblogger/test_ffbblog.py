"""Written, repaired and converted files compared with Fawkes' ffbblog (``CXBRIDGE_FFBBLOG``)."""

from __future__ import annotations

import os
import struct
import subprocess
from pathlib import Path
from random import Random

import pytest

from cxbridge.events import BlockWrite
from cxbridge.interfaces.registry import default_registry
from cxbridge.interfaces.schema import FieldSchema, InterfaceSchema
from cxbridge.trace.convert import convert
from cxbridge.trace.formats.registry import open_run
from cxbridge_fawkes.bblogger.header import COUNT_OFFSET, HEADER_SIZE
from cxbridge_fawkes.bblogger.writer import BBLoggerWriter

FFBBLOG = os.environ.get("CXBRIDGE_FFBBLOG", "")
START_US = 1_700_000_000_123_456
COUNT = 40

pytestmark = pytest.mark.skipif(not FFBBLOG, reason="CXBRIDGE_FFBBLOG names no ffbblog")


def ffbblog(*args: object) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run([FFBBLOG, *map(str, args)], capture_output=True, check=False, timeout=60)


def random_block(schema: InterfaceSchema, random: Random, number: int) -> bytes:
    block = bytearray(random.randbytes(schema.datasize))
    struct.pack_into("=qq", block, 0, START_US // 10**6 + number, number)
    for field in schema.fields:
        block[field.offset : field.offset + field.size] = _content(field, random)
    return bytes(block)


def _content(field: FieldSchema, random: Random) -> bytes:
    if field.is_string:
        text = bytes(random.choice(b'ab;"\n\xff,') for _ in range(random.randrange(field.size)))
        return text.ljust(field.size, b"\0")
    if field.type == "bool":
        return bytes(random.randrange(2) for _ in range(field.size))
    if field.enum and random.random() < 0.7:
        items = [random.choice(field.enum.items).value for _ in range(field.runtime_length)]
        return struct.pack(f"={len(items)}i", *items)
    return random.randbytes(field.size)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Files with random values, of each type that ffbblog has a library for."""
    folder = tmp_path_factory.mktemp("files")
    random = Random(7)
    with BBLoggerWriter(folder, "a scenario", start_us=START_US) as writer:
        for name in default_registry().names():
            schema = default_registry().schema(name)
            for number in range(COUNT):
                block = random_block(schema, random, number)
                time_us = START_US + number * 1_234_567
                writer.write(BlockWrite(time_us, f"{name}::an id/{name[:3]}", schema.hash, block))
    accepted = [path for path in sorted(folder.iterdir()) if ffbblog("info", path).returncode == 0]
    assert accepted
    return accepted


def test_ffbblog_reads_and_converts_written_files_equally(files: list[Path], tmp_path: Path) -> None:
    for path in files:
        assert ffbblog("info", path).stdout.decode() == "".join(
            f"{each}\n" for each in open_run(path).description()
        )
        printed = ffbblog("print", path, 0, COUNT - 1)
        assert printed.returncode == 0
        assert printed.stdout.count(b"Time Offset: ") == 2
        expected, actual = tmp_path / f"{path.stem}.expected", tmp_path / "actual.csv"
        assert ffbblog("convert", path, expected, "csv").returncode == 0
        assert convert(open_run(path), actual, "csv") == []
        assert actual.read_bytes() == expected.read_bytes()


def test_repair_equals_that_of_ffbblog(files: list[Path], tmp_path: Path) -> None:
    random = Random(8)
    path, actual = tmp_path / "a.log", tmp_path / "actual"
    for _ in range(200):
        data = random.choice(files).read_bytes()
        damaged = bytearray(data[: random.randrange(HEADER_SIZE, len(data))])
        struct.pack_into("=I", damaged, COUNT_OFFSET, random.choice([0, 3, COUNT, 1 << 31]))
        path.write_bytes(damaged)
        repairs = open_run(path).find_repairs()
        assert repairs is not None
        actions, write = repairs
        write(actual)
        result = ffbblog("repair", path)
        assert result.returncode == 0
        assert path.read_bytes() == actual.read_bytes()
        actions_of_ffbblog = [
            line for line in result.stderr.decode().splitlines() if line.startswith("FIXING")
        ]
        # ffbblog reports a correct count of 0 as a repair
        assert [line for line in actions_of_ffbblog if "setting to 0." not in line] == actions
