"""Hand-made files of bblogger."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Any

from cxbridge.interfaces.known_hashes import hash_for_wire
from cxbridge.interfaces.registry import default_registry

KIND = "SpeechSynthInterface"
START_S = 1_400_000_000


def make_file(
    entries: Sequence[tuple[int, int]],
    *,
    flag: int = 1,
    count: int = 0,
    size: int = 0,
    kind: str = KIND,
    version: bytes | None = None,
    scenario: str = "test",
    fill: Callable[[int], dict[str, Any]] = lambda _: {"final": True},
) -> bytes:
    """Return a file with entries of (seconds after the start, time stamp of the block in seconds).

    :param size: a wrong block size for the header.
    :param fill: returns the values of the entry with a number.
    """
    schema = default_registry().schema(KIND)
    block_size = schema.datasize
    data = b"\xff\xbb\xff\xbb\0\0\0\x01" + struct.pack(
        "<II32s48s64s16sIqq",
        flag,
        count,
        scenario.encode(),
        kind.encode(),
        b"Flite",
        hash_for_wire(schema) if version is None else version,
        size or block_size,
        START_S,
        0,
    )
    for number, (since, stamp) in enumerate(entries):
        block = bytearray(size or block_size)
        struct.pack_into("<qq", block, 0, stamp, 0)
        if not size:
            for field in schema.fields:
                value = fill(number).get(field.name)
                if value is not None:
                    code = f"{field.size}s" if field.is_string else field.storage.code
                    struct.pack_into(f"<{code}", block, field.offset, value)
        data += struct.pack("<II", since, 0) + block
    return data
