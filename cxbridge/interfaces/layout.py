"""Offsets of the fields of a block, as in the C struct of Fawkes' generator.

A block begins with the time stamp, two signed 64-bit integers for seconds and microseconds. The fields follow
in order, aligned to the size of their elements. The end is padded to 8 bytes because of the time stamp.
"""

from __future__ import annotations

from collections.abc import Iterable

from msgspec.structs import replace

from cxbridge.interfaces.fieldtypes import storage_type
from cxbridge.interfaces.schema import EnumSchema, FieldSchema

TIMESTAMP_SIZE = 16
"""The number of bytes of the time stamp at the start of a block."""

BLOCK_ALIGNMENT = 8
"""The size of a block is a multiple of this number of bytes."""


def make_field(
    name: str,
    type_name: str,
    length: int | None = None,
    *,
    enum: EnumSchema | None = None,
    comment: str = "",
    default: str | None = None,
    flags: tuple[str, ...] = (),
) -> FieldSchema:
    """Return a field with sizes and the preliminary offset 0."""
    elem_size = storage_type(type_name).size
    return FieldSchema(
        name,
        type_name,
        length,
        offset=0,
        size=elem_size * (1 if length is None else length),
        elem_size=elem_size,
        comment=comment,
        enum=enum,
        default=default,
        flags=flags,
    )


def place_fields(fields: Iterable[FieldSchema]) -> tuple[tuple[FieldSchema, ...], int]:
    """Assign the offsets of fields.

    :returns: the placed fields in order, and the size of the block in bytes.
    """
    placed_fields = []
    end = TIMESTAMP_SIZE
    for field in fields:
        offset = round_up(end, field.elem_size)
        placed_fields.append(replace(field, offset=offset))
        end = offset + field.size
    return tuple(placed_fields), round_up(end, BLOCK_ALIGNMENT)


def round_up(offset: int, alignment: int) -> int:
    """Round an offset up to a multiple of the alignment."""
    # `//` rounds down: the division of the negative number rounds up
    return -(-offset // alignment) * alignment
