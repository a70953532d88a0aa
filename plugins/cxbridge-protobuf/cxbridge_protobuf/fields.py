"""Reads and sets the fields of messages as CLIPS values.

docs/evidence/protocol-protobuf.md lists the conversions between the types of protobuf and CLIPS.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Final

from google.protobuf import message_factory
from google.protobuf.descriptor import FieldDescriptor
from msgspec import Struct

from cxbridge.errors import ProtobufError
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from cxbridge_protobuf.types import Message

# The names for rules by type code. Fawkes has no name for groups, either: their type is UNKNOWN.
_TYPE_NAMES: Final = {
    value: Symbol(name.removeprefix("TYPE_"))
    for name, value in vars(FieldDescriptor).items()
    if name.startswith("TYPE_") and name != "TYPE_GROUP"
}
_FLOAT_TYPES: Final = frozenset([FieldDescriptor.TYPE_DOUBLE, FieldDescriptor.TYPE_FLOAT])
_UNSIGNED_64_TYPES: Final = frozenset([FieldDescriptor.TYPE_UINT64, FieldDescriptor.TYPE_FIXED64])
# CLIPS has only signed 64-bit integers: an unsigned number from 2**63 appears there smaller by 2**64
_HALF_RANGE, _FULL_RANGE = 1 << 63, 1 << 64

AddMessage = Callable[[Message], Value]  # stores a message, and returns its address for CLIPS

# returns the message at an address; None if the address is unknown
GetMessage = Callable[[Value], Message | None]


class MessageField(Struct, frozen=True):
    """A field of a message type.

    The object caches properties of the descriptor, which protobuf computes slowly.

    :param descriptor: the ``FieldDescriptor`` of protobuf.
    :param type_code: a ``FieldDescriptor.TYPE_...``.
    :param is_list: whether the field is repeated; maps are repeated fields, too.
    :param nested_type: the full name of the field's message type; empty for other types.
    """

    descriptor: Any
    name: str
    type_code: int
    is_list: bool
    is_map: bool
    nested_type: str


@functools.lru_cache(maxsize=4096)  # more fields than the messages of an agent have
def _find_cached_field(message_type: Any, name: str) -> MessageField | None:
    field = message_type.fields_by_name.get(name)
    if field is None:
        return None
    message = field.message_type
    # recent versions of protobuf have is_repeated, and deprecate label
    is_repeated = getattr(field, "is_repeated", None)
    return MessageField(
        descriptor=field,
        name=name,
        type_code=field.type,
        is_list=bool(field.label == field.LABEL_REPEATED if is_repeated is None else is_repeated),
        is_map=message is not None and bool(message.GetOptions().map_entry),
        nested_type="" if message is None else message.full_name,
    )


def find_field(message: Message, name: str) -> MessageField | None:
    """Return the field of a message with a name; None if its type has no such field."""
    return _find_cached_field(message.DESCRIPTOR, name)


def field_names(message: Message) -> tuple[str, ...]:
    """Return the names of all declared fields in order."""
    return tuple(field.name for field in message.DESCRIPTOR.fields)


def field_type(field: MessageField) -> Symbol:
    """Return the type of a field, e.g. ``UINT32``."""
    return _TYPE_NAMES.get(field.type_code, Symbol("UNKNOWN"))


def field_label(field: MessageField) -> Symbol:
    """Return ``OPTIONAL``, ``REQUIRED`` or ``REPEATED``."""
    if field.is_list:
        return Symbol("REPEATED")
    descriptor = field.descriptor
    # recent versions of protobuf have is_required, and deprecate label
    is_required = getattr(descriptor, "is_required", None)
    if is_required is None:
        is_required = descriptor.label == descriptor.LABEL_REQUIRED
    return Symbol("REQUIRED" if is_required else "OPTIONAL")


def has_value(message: Message, field: MessageField) -> bool:
    """Return whether a field is set; a list or map is set if it is not empty."""
    if field.is_list:
        return len(getattr(message, field.name)) > 0
    if field.descriptor.has_presence:
        return bool(message.HasField(field.name))
    # a field of proto3 without presence counts as set if its value differs from the default
    return any(descriptor.number == field.descriptor.number for descriptor, _ in message.ListFields())


def field_value(message: Message, field: MessageField, add_message: AddMessage) -> Value:
    """Return the value of a field other than a list; the default value of a field that is not set."""
    if field.type_code == FieldDescriptor.TYPE_BYTES:
        return "bytes"  # as in protobuf_comm, since CLIPS has no type for bytes
    return _to_clips(field, getattr(message, field.name), add_message)


def list_values(message: Message, field: MessageField, add_message: AddMessage) -> tuple[Value, ...]:
    """Return the elements of a list or map; see :func:`_list_elements`."""
    if field.type_code == FieldDescriptor.TYPE_BYTES:
        # protobuf_comm has this symbol in lists, but the string for a single value
        return (Symbol("BYTES"),) * len(getattr(message, field.name))
    return tuple(_to_clips(field, item, add_message) for item in _list_elements(message, field))


def change_value(
    message: Message, field: MessageField, clips_value: Value, get_message: GetMessage, *, is_added: bool
) -> None:
    """Set a field, or append to a list; fields of bytes stay unchanged.

    :param is_added: whether to append to a list.
    :raises UnknownEnumValueError: if the enumeration of the field has no such value.
    :raises ProtobufError: if the field is a list and is not appended to, or the reverse, or if the value does
        not suit the type of the field.
    """
    if field.is_list != is_added:
        raise ProtobufError(
            "it is a list" if field.is_list else "it is not a list",
            hint="pb-add-list" if field.is_list else "pb-set-field",
        )
    if field.type_code == FieldDescriptor.TYPE_BYTES:
        return  # ignored, as by protobuf_comm
    protobuf_value = _to_protobuf(field, clips_value, get_message)
    field_content = getattr(message, field.name)
    try:
        if field.is_map:
            _set_map_entry(field_content, protobuf_value)
        elif field.type_code == FieldDescriptor.TYPE_MESSAGE:
            (field_content.add() if is_added else field_content).CopyFrom(protobuf_value)
        elif is_added:
            field_content.append(protobuf_value)
        else:
            setattr(message, field.name, protobuf_value)
    except (TypeError, ValueError) as error:
        raise ProtobufError(str(error)) from None


def _list_elements(message: Message, field: MessageField) -> list[Any]:
    """Return the elements of a list; the elements of a map are messages with ``key`` and ``value``."""
    container = getattr(message, field.name)
    if not field.is_map:
        return list(container)
    entry_type = field.descriptor.message_type
    entry_class = message_factory.GetMessageClass(entry_type)
    map_entries = []
    for key in container:
        map_entry: Any = entry_class(key=key)
        if entry_type.fields_by_name["value"].message_type is None:
            map_entry.value = container[key]
        else:
            map_entry.value.CopyFrom(container[key])
        map_entries.append(map_entry)
    return map_entries


def _set_map_entry(container: Any, entry: Message) -> None:
    if entry.DESCRIPTOR.fields_by_name["value"].message_type is None:
        container[entry.key] = entry.value
    else:
        container[entry.key].CopyFrom(entry.value)


def _to_clips(field: MessageField, item: Any, add_message: AddMessage) -> Value:
    if field.type_code == FieldDescriptor.TYPE_MESSAGE:
        # a copy, since rules may destroy the outer message first
        copy = type(item)()
        copy.CopyFrom(item)
        return add_message(copy)
    if field.type_code == FieldDescriptor.TYPE_BOOL:
        return TRUE if item else FALSE
    if field.type_code == FieldDescriptor.TYPE_ENUM:
        enum_value = field.descriptor.enum_type.values_by_number.get(item)
        return Symbol(
            enum_value.name if enum_value else f"UNKNOWN_ENUM_VALUE_{field.descriptor.enum_type.name}_{item}"
        )
    if field.type_code in _UNSIGNED_64_TYPES and item >= _HALF_RANGE:
        return item - _FULL_RANGE
    return item


def _to_protobuf(field: MessageField, clips_value: Value, get_message: GetMessage) -> Any:
    """Convert a CLIPS value to the type of a field.

    :raises UnknownEnumValueError: if the enumeration of the field has no such value.
    :raises ProtobufError: if the value does not suit the type of the field.
    """
    type_code = field.type_code
    if type_code == FieldDescriptor.TYPE_MESSAGE:
        nested_message = get_message(clips_value)
        if nested_message is None:
            raise ProtobufError("the value is not a valid message")
        if nested_message.DESCRIPTOR.full_name != field.nested_type:
            raise ProtobufError(f"it takes {field.nested_type}, not {nested_message.DESCRIPTOR.full_name}")
        return nested_message
    if type_code == FieldDescriptor.TYPE_BOOL:
        return clips_value == "TRUE"
    if type_code in (FieldDescriptor.TYPE_STRING, FieldDescriptor.TYPE_ENUM):
        if not isinstance(clips_value, str):
            raise ProtobufError(f"{clips_value} is not a STRING or SYMBOL")
        return (
            clips_value if type_code == FieldDescriptor.TYPE_STRING else _find_enum_number(field, clips_value)
        )
    if isinstance(clips_value, bool) or not isinstance(clips_value, int | float):
        raise ProtobufError(f"{clips_value} is not a number")
    if type_code in _FLOAT_TYPES:
        return float(clips_value)
    try:
        integer = int(clips_value)
    except (OverflowError, ValueError):
        raise ProtobufError(f"{clips_value} is not a whole number") from None
    return (
        integer + _FULL_RANGE if type_code in _UNSIGNED_64_TYPES and -_HALF_RANGE <= integer < 0 else integer
    )


class UnknownEnumValueError(ProtobufError):
    """An enumeration has no value with the name that a rule has set."""


def _find_enum_number(field: MessageField, name: str) -> int:
    enum_value = field.descriptor.enum_type.values_by_name.get(name)
    if enum_value is None:
        raise UnknownEnumValueError(f"there is no '{name}' in {field.descriptor.enum_type.name}")
    return int(enum_value.number)
