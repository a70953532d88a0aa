"""Decoding of interface blocks into events.

A block is the value of an interface in the memory layout of Fawkes: a time stamp, then the fields.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, TypeAlias

from cxbridge.events import InterfaceWrite, SkillStatus
from cxbridge.interfaces.layout import TIMESTAMP_SIZE
from cxbridge.interfaces.schema import FieldSchema, InterfaceSchema

ENV: Final = "executive"
"""The environment of decoded states of Skillers: blocks do not name an environment."""

_SKILLER_TYPE = "SkillerInterface"
_FieldConverter: TypeAlias = Callable[[tuple[Any, ...]], Any]


class BlockDecoder:
    """Decodes the little endian blocks of an interface type.

    :param decode_text: returns the value of a text field from its zero-padded bytes; None:
        :func:`decode_padded_text`.
    """

    def __init__(
        self, schema: InterfaceSchema, decode_text: Callable[[bytes], str | bytes] | None = None
    ) -> None:
        self.schema = schema
        # a struct format: x skips the time stamp, and the padding between the fields
        struct_format = f"<{TIMESTAMP_SIZE}x"
        end, index = TIMESTAMP_SIZE, 0
        # the name of a field, the index of its first element, and the function that converts the elements
        self._fields: list[tuple[str, int, _FieldConverter | None]] = []
        for field in schema.fields:
            count = 1 if field.is_string else field.runtime_length
            element = f"{field.size}s" if field.is_string else f"{count}{field.storage.code}"
            struct_format += f"{field.offset - end}x{element}"
            self._fields.append(
                (
                    field.name,
                    index,
                    _make_converter(field, index, index + count, decode_text or decode_padded_text),
                )
            )
            end, index = field.offset + field.size, index + count
        self._unpack = struct.Struct(struct_format).unpack_from

    def decode(self, block: bytes | memoryview) -> dict[str, Any]:
        """Return the values by field: texts, numbers, names of enum items, lists.

        :param block: of the size in the schema. An enum value without an item stays a number.
        """
        elements = self._unpack(block)
        return {
            name: elements[index] if convert is None else convert(elements)
            for name, index, convert in self._fields
        }


def block_events(
    schema: InterfaceSchema, uid: str, time_us: int, block: bytes | memoryview
) -> Iterator[InterfaceWrite | SkillStatus]:
    """Yield the write of a block, and the state of the Skiller for a SkillerInterface.

    :param uid: ``Type::id``.
    :param block: of the size in the schema, little endian.
    """
    return write_events(schema.name, uid, time_us, _cached_decoder(schema).decode(block))


def write_events(
    interface_type: str, uid: str, time_us: int, values: Mapping[str, Any]
) -> Iterator[InterfaceWrite | SkillStatus]:
    """Yield the write of values, and the state of the Skiller for a SkillerInterface.

    :param uid: ``Type::id``.
    :param values: by field. A block of an unknown layout has no ``skill_string``, so that its write has no
        state of the Skiller.
    """
    yield InterfaceWrite(time_us, uid, values)
    if interface_type == _SKILLER_TYPE and "skill_string" in values:
        skill, msgid, status = (values.get(name) for name in ("skill_string", "msgid", "status"))
        yield SkillStatus(
            time_us,
            ENV,
            uid.partition("::")[2],
            str(skill),
            msgid if isinstance(msgid, int) else 0,
            str(status),
        )


def decode_padded_text(data: bytes) -> str:
    r"""Return the text before the first null byte; bytes that are not UTF-8 become ``\xNN``."""
    return data.split(b"\0", 1)[0].decode("utf-8", "backslashreplace")


def _make_converter(
    field: FieldSchema, start: int, end: int, decode_text: Callable[[bytes], str | bytes]
) -> _FieldConverter | None:
    """Return a function from the elements of a block to a field's value; None if one element is the value."""
    if field.is_string:
        return lambda elements: decode_text(elements[start])
    item_names = {item.value: item.name for item in field.enum.items} if field.enum else {}
    if field.length is None:
        return (lambda elements: item_names.get(elements[start], elements[start])) if field.is_enum else None
    if field.is_enum:
        return lambda elements: [item_names.get(value, value) for value in elements[start:end]]
    return lambda elements: list(elements[start:end])


# By the identity of schemas, because comparing schemas takes longer than decoding; a decoder keeps its schema
# alive.
_decoders: dict[int, BlockDecoder] = {}


def _cached_decoder(schema: InterfaceSchema) -> BlockDecoder:
    decoder = _decoders.get(id(schema))
    if decoder is None or decoder.schema is not schema:
        decoder = _decoders[id(schema)] = BlockDecoder(schema)
    return decoder
