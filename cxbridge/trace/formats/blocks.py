"""Decodes the bytes of an interface, in any layout that there ever was, into the events of its write."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, TypeAlias

from cxbridge.events import InterfaceWrite, SkillStatus
from cxbridge.interfaces.schema import FieldSchema, InterfaceSchema

ENV: Final = "executive"
"""The environment that the states of skillers are said to be read by; a block does not tell."""

STAMP_SIZE: Final = 16
"""Bytes of the time stamp that every block begins with since 2010."""

NATURAL: Final = 8
"""Alignment of fields today: each to its own size."""

PACKINGS: Final = (NATURAL, 4, 1)
"""Every alignment that blocks had: natural in 2010 and since 2019, 4 bytes until 2016, then none.

Where two of them differ at all, so do the sizes of the blocks: the size says which it is."""

_SKILLER = "SkillerInterface"
_Convert: TypeAlias = Callable[[tuple[Any, ...]], Any]


def field_offsets(schema: InterfaceSchema, packing: int = NATURAL) -> tuple[tuple[int, ...], int]:
    """Return where in a block the fields lie, and the size of the block, both in bytes.

    :param packing: one of :data:`PACKINGS`.
    """
    offsets = []
    end = STAMP_SIZE
    for field in schema.fields:
        end = _aligned(end, min(packing, field.elem_size))
        offsets.append(end)
        end += field.size
    return tuple(offsets), _aligned(end, packing)


def packing_of(schema: InterfaceSchema, size: int) -> int | None:
    """Return the packing that makes blocks of this size, None when none does."""
    if size == schema.datasize:
        return NATURAL
    return next((each for each in PACKINGS if field_offsets(schema, each)[1] == size), None)


class BlockDecoder:
    """Reads the values of blocks of one layout.

    :param order: byte order as :mod:`struct` calls it.
    :param packing: one of :data:`PACKINGS`.
    """

    def __init__(self, schema: InterfaceSchema, order: str = "=", packing: int = NATURAL) -> None:
        self.schema = schema
        offsets, self.size = field_offsets(schema, packing)
        code = f"{order}{STAMP_SIZE}x"
        end, first = STAMP_SIZE, 0
        self._fields: list[tuple[str, int, _Convert | None]] = []
        for field, offset in zip(schema.fields, offsets, strict=True):
            count = 1 if field.is_string else field.runtime_length
            element = f"{field.size}s" if field.is_string else f"{count}{field.storage.code}"
            code += f"{offset - end}x{element}"
            self._fields.append((field.name, first, _converter(field, first, first + count)))
            end, first = offset + field.size, first + count
        self._unpack = struct.Struct(code).unpack_from

    def raw(self, block: bytes | memoryview) -> tuple[Any, ...]:
        """Return the numbers and texts (padded bytes) of a block, the elements of arrays one by one."""
        return self._unpack(block)

    def values(self, block: bytes | memoryview) -> dict[str, Any]:
        """Return the values by field: text, numbers, names of enum items, lists."""
        raw = self._unpack(block)
        return {
            name: raw[index] if convert is None else convert(raw) for name, index, convert in self._fields
        }


def block_events(
    schema: InterfaceSchema, uid: str, time_us: int, block: bytes | memoryview
) -> Iterator[InterfaceWrite | SkillStatus]:
    """Yield the write of a block of this machine, and the state of the skiller if it is one's.

    :param uid: ``Type::id``.
    :param block: as large as the schema says.
    """
    return write_events(schema.name, uid, time_us, _decoder(schema).values(block))


def write_events(
    kind: str, uid: str, time_us: int, values: Mapping[str, Any]
) -> Iterator[InterfaceWrite | SkillStatus]:
    """Yield the write of these values, and the state of the skiller if it is one's.

    :param kind: the type of the interface.
    :param uid: ``Type::id``.
    """
    yield InterfaceWrite(time_us, uid, values)
    if kind == _SKILLER and "skill_string" in values:
        skill, msgid, status = (values.get(name) for name in ("skill_string", "msgid", "status"))
        number = msgid if isinstance(msgid, int) else 0
        yield SkillStatus(time_us, ENV, uid.partition("::")[2], str(skill), number, str(status))


def padded_text(data: bytes) -> str:
    """Return a text that is padded with zeros."""
    return data.split(b"\0", 1)[0].decode("utf-8", "backslashreplace")


def item_names(field: FieldSchema) -> dict[int, str]:
    """Return the names of an enum's items by their values; none for another field."""
    return {item.value: item.name for item in field.enum.items} if field.enum else {}


def _aligned(offset: int, alignment: int) -> int:
    return -(-offset // alignment) * alignment


def _converter(field: FieldSchema, start: int, end: int) -> _Convert | None:
    """Return what makes a value of the elements from ``start`` to ``end``; None: it is the element itself."""
    if field.is_string:
        return lambda raw: padded_text(raw[start])
    names = item_names(field)
    if field.length is None:
        return (lambda raw: names.get(raw[start], raw[start])) if field.is_enum else None
    if field.is_enum:
        return lambda raw: [names.get(value, value) for value in raw[start:end]]
    return lambda raw: list(raw[start:end])


_decoders: dict[int, BlockDecoder] = {}
"""By the identity of their schemas, which they keep alive: comparing schemas takes longer than decoding."""


def _decoder(schema: InterfaceSchema) -> BlockDecoder:
    decoder = _decoders.get(id(schema))
    if decoder is None or decoder.schema is not schema:
        decoder = _decoders[id(schema)] = BlockDecoder(schema)
    return decoder
