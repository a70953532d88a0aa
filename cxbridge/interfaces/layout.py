"""The offsets of the fields of a block: the C struct that Fawkes' generator would have written.

A block begins with two signed 64 bit integers, the timestamp's seconds and microseconds; then come the
fields in their order, each aligned to the size of its element. The end is padded to 8 bytes because of
those two.
"""

from __future__ import annotations

from collections.abc import Iterable

from msgspec.structs import replace

from cxbridge.interfaces.fieldtypes import storage_type
from cxbridge.interfaces.schema import EnumSchema, FieldSchema

TIMESTAMP_SIZE = 16
"""Bytes of the timestamp at the start of every block."""

BLOCK_ALIGNMENT = 8
"""The alignment of a block, and what its size is a multiple of."""


def make_field(
    name: str,
    type_name: str,
    length: int | None = None,
    *,
    enum: EnumSchema | None = None,
    comment: str = "",
    validfor: str | None = None,
    default: str | None = None,
    flags: tuple[str, ...] = (),
) -> FieldSchema:
    """Make a field that has its sizes, but no place yet (offset 0)."""
    elem_size = storage_type(type_name).size
    size = elem_size * (1 if length is None else length)
    return FieldSchema(name, type_name, length, 0, size, elem_size, comment, enum, validfor, default, flags)


def place_fields(fields: Iterable[FieldSchema]) -> tuple[tuple[FieldSchema, ...], int]:
    """Give each field its offset.

    :return: the placed fields in the same order, and the size of the block in bytes.
    """
    placed = []
    end = TIMESTAMP_SIZE
    for field in fields:
        offset = align(end, field.elem_size)
        placed.append(replace(field, offset=offset))
        end = offset + field.size
    return tuple(placed), align(end, BLOCK_ALIGNMENT)


def align(offset: int, alignment: int) -> int:
    """Return the first multiple of the alignment that is not below the offset."""
    return -(-offset // alignment) * alignment
