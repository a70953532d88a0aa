"""The fields of messages as CLIPS values. Conversions: docs/evidence/protocol-protobuf.md."""

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

_TYPE_NAMES: Final = {
    value: Symbol(name.removeprefix("TYPE_"))
    for name, value in vars(FieldDescriptor).items()
    if name.startswith("TYPE_") and name != "TYPE_GROUP"
}
_FLOATS: Final = frozenset([FieldDescriptor.TYPE_DOUBLE, FieldDescriptor.TYPE_FLOAT])
_UNSIGNED_64: Final = frozenset([FieldDescriptor.TYPE_UINT64, FieldDescriptor.TYPE_FIXED64])
# Unsigned numbers from 2**63 appear in CLIPS as negative ones, smaller by 2**64.
_HALF, _WHOLE = 1 << 63, 1 << 64

AddMessage = Callable[[Message], Value]  # stores a message and returns the address for CLIPS

GetMessage = Callable[[Value], Message]  # returns the message at an address; None if the address is unknown


class MessageField(Struct, frozen=True):
    """A field of a message type.

    It caches the properties of the descriptor, whose queries take longer than the assignment of a value.

    :param descriptor: the ``FieldDescriptor`` of protobuf.
    :param kind: a ``FieldDescriptor.TYPE_...``.
    :param is_list: whether the field is repeated, as maps are.
    :param of: the full name of the field's message type; empty for other types.
    """

    descriptor: Any
    name: str
    kind: int
    is_list: bool
    is_map: bool
    of: str


@functools.lru_cache(maxsize=4096)
def _field(message_type: Any, name: str) -> MessageField | None:
    field = message_type.fields_by_name.get(name)
    if field is None:
        return None
    message = field.message_type
    # new versions of protobuf have is_repeated, and deprecate label
    repeated = getattr(field, "is_repeated", None)
    return MessageField(
        descriptor=field,
        name=name,
        kind=field.type,
        is_list=bool(field.label == field.LABEL_REPEATED if repeated is None else repeated),
        is_map=message is not None and bool(message.GetOptions().map_entry),
        of="" if message is None else message.full_name,
    )


def find(message: Message, name: str) -> MessageField | None:
    return _field(message.DESCRIPTOR, name)


def names(message: Message) -> tuple[str, ...]:
    """Return the names of all declared fields in order."""
    return tuple(field.name for field in message.DESCRIPTOR.fields)


def type_name(field: MessageField) -> Symbol:
    """Return the type of a field, e.g. ``UINT32``."""
    return _TYPE_NAMES.get(field.kind, Symbol("UNKNOWN"))


def label(field: MessageField) -> Symbol:
    """Return ``OPTIONAL``, ``REQUIRED`` or ``REPEATED``."""
    if field.is_list:
        return Symbol("REPEATED")
    descriptor = field.descriptor
    # new versions of protobuf have is_required, and deprecate label
    required = getattr(descriptor, "is_required", None)
    if required is None:
        required = descriptor.label == descriptor.LABEL_REQUIRED
    return Symbol("REQUIRED" if required else "OPTIONAL")


def has(message: Message, field: MessageField) -> bool:
    if field.is_list:
        return len(getattr(message, field.name)) > 0
    if field.descriptor.has_presence:
        return bool(message.HasField(field.name))
    # a field of proto3 without presence counts as set if its value differs from the default
    return any(descriptor.number == field.descriptor.number for descriptor, _ in message.ListFields())


def value(message: Message, field: MessageField, add: AddMessage) -> Value:
    """Return the value of a field other than a list."""
    if field.kind == FieldDescriptor.TYPE_BYTES:
        return "bytes"  # the text that protobuf_comm returns, since CLIPS has no type for bytes
    return _to_clips(field, getattr(message, field.name), add)


def items(message: Message, field: MessageField, add: AddMessage) -> tuple[Value, ...]:
    if field.kind == FieldDescriptor.TYPE_BYTES:
        # protobuf_comm's lists have this symbol, unlike its single values
        return (Symbol("BYTES"),) * len(getattr(message, field.name))
    return tuple(_to_clips(field, item, add) for item in _elements(message, field))


def set_value(message: Message, field: MessageField, clips_value: Value, get: GetMessage) -> None:
    """Set a field other than a list.

    :raises ProtobufError: if the field is a list or the value has a wrong type.
    """
    if field.is_list:
        raise ProtobufError("it is a list", hint="pb-add-list")
    if field.kind == FieldDescriptor.TYPE_BYTES:
        return  # ignored, as by protobuf_comm
    converted = _to_protobuf(field, clips_value, get)
    try:
        if field.kind == FieldDescriptor.TYPE_MESSAGE:
            getattr(message, field.name).CopyFrom(converted)
        else:
            setattr(message, field.name, converted)
    except (TypeError, ValueError) as error:
        raise ProtobufError(str(error)) from None


def add_value(message: Message, field: MessageField, clips_value: Value, get: GetMessage) -> None:
    """Append to a list.

    :raises ProtobufError: if the field is not a list or the value has a wrong type.
    """
    if not field.is_list:
        raise ProtobufError("it is not a list", hint="pb-set-field")
    if field.kind == FieldDescriptor.TYPE_BYTES:
        return  # ignored, as by protobuf_comm
    converted = _to_protobuf(field, clips_value, get)
    container = getattr(message, field.name)
    try:
        if field.is_map:
            _put_entry(container, converted)
        elif field.kind == FieldDescriptor.TYPE_MESSAGE:
            container.add().CopyFrom(converted)
        else:
            container.append(converted)
    except (TypeError, ValueError) as error:
        raise ProtobufError(str(error)) from None


def _elements(message: Message, field: MessageField) -> list[Any]:
    """Return the elements of a list; the elements of a map are messages with ``key`` and ``value``."""
    container = getattr(message, field.name)
    if not field.is_map:
        return list(container)
    entry_type = field.descriptor.message_type
    entry_class = message_factory.GetMessageClass(entry_type)
    entries = []
    for key in container:
        map_entry: Any = entry_class(key=key)
        if entry_type.fields_by_name["value"].message_type is None:
            map_entry.value = container[key]
        else:
            map_entry.value.CopyFrom(container[key])
        entries.append(map_entry)
    return entries


def _put_entry(container: Any, entry: Message) -> None:
    if entry.DESCRIPTOR.fields_by_name["value"].message_type is None:
        container[entry.key] = entry.value
    else:
        container[entry.key].CopyFrom(entry.value)


def _to_clips(field: MessageField, item: Any, add: AddMessage) -> Value:
    if field.kind == FieldDescriptor.TYPE_MESSAGE:
        # a copy, since rules may destroy the outer message first
        copy = type(item)()
        copy.CopyFrom(item)
        return add(copy)
    if field.kind == FieldDescriptor.TYPE_BOOL:
        return TRUE if item else FALSE
    if field.kind == FieldDescriptor.TYPE_ENUM:
        enum_value = field.descriptor.enum_type.values_by_number.get(item)
        return Symbol(
            enum_value.name if enum_value else f"UNKNOWN_ENUM_VALUE_{field.descriptor.enum_type.name}_{item}"
        )
    # CLIPS has signed 64-bit integers only
    if field.kind in _UNSIGNED_64 and item >= _HALF:
        return item - _WHOLE
    return item


def _to_protobuf(field: MessageField, clips_value: Value, get: GetMessage) -> Any:
    """Convert a CLIPS value to the type of a field."""
    kind = field.kind
    if kind == FieldDescriptor.TYPE_MESSAGE:
        nested_message = get(clips_value)
        if nested_message is None:
            raise ProtobufError("the value is not a valid message")
        if nested_message.DESCRIPTOR.full_name != field.of:
            raise ProtobufError(f"it takes {field.of}, not {nested_message.DESCRIPTOR.full_name}")
        return nested_message
    if kind == FieldDescriptor.TYPE_BOOL:
        return clips_value == "TRUE"
    if kind in (FieldDescriptor.TYPE_STRING, FieldDescriptor.TYPE_ENUM):
        if not isinstance(clips_value, str):
            raise ProtobufError(f"{clips_value} is not a STRING or SYMBOL")
        return clips_value if kind == FieldDescriptor.TYPE_STRING else _enum_number(field, clips_value)
    if isinstance(clips_value, bool) or not isinstance(clips_value, int | float):
        raise ProtobufError(f"{clips_value} is not a number")
    if kind in _FLOATS:
        return float(clips_value)
    try:
        integer = int(clips_value)
    except (OverflowError, ValueError):
        raise ProtobufError(f"{clips_value} is not a whole number") from None
    return integer + _WHOLE if kind in _UNSIGNED_64 and -_HALF <= integer < 0 else integer


class UnknownEnumValueError(ProtobufError):
    """An enumeration has no value with a name."""


def _enum_number(field: MessageField, name: str) -> int:
    enum_value = field.descriptor.enum_type.values_by_name.get(name)
    if enum_value is None:
        raise UnknownEnumValueError(f"there is no '{name}' in {field.descriptor.enum_type.name}")
    return int(enum_value.number)
