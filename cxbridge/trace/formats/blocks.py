"""From the bytes of an interface to the events that a write of it means."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any, Final

from cxbridge.events import InterfaceWrite, SkillStatus
from cxbridge.interfaces.schema import FieldSchema, InterfaceSchema

ENV: Final = "executive"
"""The environment that the states of skillers are said to be read by; a block does not tell."""

_SKILLER = "SkillerInterface"


def block_events(
    schema: InterfaceSchema, uid: str, time_us: int, block: bytes | memoryview, order: str = "="
) -> Iterator[InterfaceWrite | SkillStatus]:
    """Yield the write of a block, and the state of the skiller if it is one's.

    :param uid: ``Type::id``.
    :param block: as large as the schema says.
    :param order: byte order as :mod:`struct` calls it.
    """
    view = memoryview(block)
    values = {field.name: _value(field, schema, view, order) for field in schema.fields}
    yield InterfaceWrite(time_us, uid, values)
    if schema.name == _SKILLER:
        skiller = uid.partition("::")[2]
        skill, msgid, status = (values.get(name) for name in ("skill_string", "msgid", "status"))
        yield SkillStatus(time_us, ENV, skiller, str(skill), int(msgid or 0), str(status))


def padded_text(data: bytes) -> str:
    """Return a text that is padded with zeros."""
    return data.split(b"\0", 1)[0].decode("utf-8", "backslashreplace")


def _value(field: FieldSchema, schema: InterfaceSchema, block: memoryview, order: str) -> Any:
    """Return the value of a field: a text, a number, the name of an enum's item, or a list."""
    if field.type == "string":
        return padded_text(bytes(block[field.offset : field.offset + field.size]))
    code = f"{order}{field.length or 1}{field.storage.code}"
    values: list[Any] = list(struct.unpack_from(code, block, field.offset))
    if field.is_enum:
        names = _item_names(schema, field.type)
        values = [names.get(value, value) for value in values]
    return values[0] if field.length is None else values


def _item_names(schema: InterfaceSchema, enum: str) -> dict[int, str]:
    """Return the names of an enum's items by their values."""
    return {item.value: item.name for each in schema.enums if each.name == enum for item in each.items}
