"""bblogger files made by hand, in every layout."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Any

from cxbridge.interfaces.known_hashes import hash_for_wire
from cxbridge.interfaces.registry import default_registry
from cxbridge.trace.formats.bblogger.header import LAYOUTS, HeaderLayout
from cxbridge.trace.formats.blocks import NATURAL, field_offsets

KIND = "SpeechSynthInterface"
START_S = 1_400_000_000


def make(  # noqa: PLR0913  everything that can be in a header
    order: str,
    entries: Sequence[tuple[int, int]],
    *,
    layout: HeaderLayout = LAYOUTS[0],
    packing: int = NATURAL,
    flag: int = 1,
    count: int = 0,
    size: int = 0,
    kind: str = KIND,
    version: bytes | None = None,
    scenario: str = "test",
    fill: Callable[[int], dict[str, Any]] = lambda _: {"final": True},
) -> bytes:
    """A file whose entries were written at these (seconds after start, seconds of the block).

    :param size: of a block, if the header is to lie about it.
    :param fill: the values of the entry of that number.
    """
    schema = default_registry().schema(KIND)
    offsets, block_size = field_offsets(schema, packing)
    data = layout.magic + struct.pack(
        f"{order}{layout.fields}",
        flag if order == "<" else flag << 31,
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
        struct.pack_into(f"{order}qq", block, 0, stamp, 0)
        if not size:
            for field, offset in zip(schema.fields, offsets, strict=True):
                value = fill(number).get(field.name)
                if value is not None:
                    code = f"{field.size}s" if field.is_string else field.storage.code
                    struct.pack_into(f"{order}{code}", block, offset, value)
        data += struct.pack(f"{order}II", since, 0) + block
    return data
