"""The fields of messages as values of CLIPS. What becomes what: docs/evidence/protocol-protobuf.md."""

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
_HALF, _WHOLE = 1 << 63, 1 << 64

AddMessage = Callable[[Message], Value]
"""Makes a message known to CLIPS and returns its address."""

GetMessage = Callable[[Value], Message]
"""Returns the message of an address; None when there is none."""


class MessageField(Struct, frozen=True):
    """A field of a type of messages. To ask its descriptor costs more than to set it: here it has been asked.

    :param descriptor: protobuf's own description.
    :param kind: of ``FieldDescriptor.TYPE_...``.
    :param is_list: whether it is repeated; maps are.
    :param is_map: whether it is a map.
    :param of: the full name of the messages that it holds; empty when it holds none.
    """

    descriptor: Any
    name: str
    kind: int
    is_list: bool
    is_map: bool
    of: str


@functools.lru_cache(maxsize=4096)
def _field(of: Any, name: str) -> MessageField | None:
    """Return a field of a type of messages, by the type's descriptor."""
    field = of.fields_by_name.get(name)
    if field is None:
        return None
    message = field.message_type
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
    """Return a field, None when there is none of that name."""
    return _field(message.DESCRIPTOR, name)


def names(message: Message) -> tuple[str, ...]:
    """Return the names of all fields that are declared, in their order."""
    return tuple(field.name for field in message.DESCRIPTOR.fields)


def type_name(field: MessageField) -> Symbol:
    """Return the type of a field, e.g. ``UINT32``."""
    return _TYPE_NAMES.get(field.kind, Symbol("UNKNOWN"))


def label(field: MessageField) -> Symbol:
    """Return ``OPTIONAL``, ``REQUIRED`` or ``REPEATED``."""
    if field.is_list:
        return Symbol("REPEATED")
    descriptor = field.descriptor
    required = getattr(descriptor, "is_required", None)
    if required is None:
        required = descriptor.label == descriptor.LABEL_REQUIRED
    return Symbol("REQUIRED" if required else "OPTIONAL")


def has(message: Message, field: MessageField) -> bool:
    """Whether a field is set; whether a list has something in it."""
    if field.is_list:
        return len(getattr(message, field.name)) > 0
    if field.descriptor.has_presence:
        return bool(message.HasField(field.name))
    return any(known.number == field.descriptor.number for known, _ in message.ListFields())


def value(message: Message, field: MessageField, add: AddMessage) -> Value:
    """Return the value of a field that is not a list."""
    if field.kind == FieldDescriptor.TYPE_BYTES:
        return "bytes"
    return _to_clips(field, getattr(message, field.name), add)


def items(message: Message, field: MessageField, add: AddMessage) -> tuple[Value, ...]:
    """Return the values of a list."""
    if field.kind == FieldDescriptor.TYPE_BYTES:
        return (Symbol("BYTES"),) * len(getattr(message, field.name))
    return tuple(_to_clips(field, item, add) for item in _elements(message, field))


def set_value(message: Message, field: MessageField, given: Value, get: GetMessage) -> None:
    """Set a field that is not a list.

    :raises ProtobufError: when it is one, or cannot have this value.
    """
    if field.is_list:
        raise ProtobufError("it is a list", hint="pb-add-list")
    if field.kind == FieldDescriptor.TYPE_BYTES:
        return
    converted = _to_protobuf(field, given, get)
    try:
        if field.kind == FieldDescriptor.TYPE_MESSAGE:
            getattr(message, field.name).CopyFrom(converted)
        else:
            setattr(message, field.name, converted)
    except (TypeError, ValueError) as error:
        raise ProtobufError(str(error)) from None


def add_value(message: Message, field: MessageField, given: Value, get: GetMessage) -> None:
    """Append to a list.

    :raises ProtobufError: when the field is none, or the list cannot hold this value.
    """
    if not field.is_list:
        raise ProtobufError("it is not a list", hint="pb-set-field")
    if field.kind == FieldDescriptor.TYPE_BYTES:
        return
    converted = _to_protobuf(field, given, get)
    here = getattr(message, field.name)
    try:
        if field.is_map:
            _put(here, converted)
        elif field.kind == FieldDescriptor.TYPE_MESSAGE:
            here.add().CopyFrom(converted)
        else:
            here.append(converted)
    except (TypeError, ValueError) as error:
        raise ProtobufError(str(error)) from None


def _elements(message: Message, field: MessageField) -> list[Any]:
    here = getattr(message, field.name)
    if not field.is_map:
        return list(here)
    of = field.descriptor.message_type
    entry = message_factory.GetMessageClass(of)
    made = []
    for key in here:
        one: Any = entry(key=key)
        if of.fields_by_name["value"].message_type is None:
            one.value = here[key]
        else:
            one.value.CopyFrom(here[key])
        made.append(one)
    return made


def _put(here: Any, entry: Message) -> None:
    """Add an entry to a map."""
    if entry.DESCRIPTOR.fields_by_name["value"].message_type is None:
        here[entry.key] = entry.value
    else:
        here[entry.key].CopyFrom(entry.value)


def _to_clips(field: MessageField, item: Any, add: AddMessage) -> Value:
    if field.kind == FieldDescriptor.TYPE_MESSAGE:
        copy = type(item)()
        copy.CopyFrom(item)
        return add(copy)
    if field.kind == FieldDescriptor.TYPE_BOOL:
        return TRUE if item else FALSE
    if field.kind == FieldDescriptor.TYPE_ENUM:
        known = field.descriptor.enum_type.values_by_number.get(item)
        return Symbol(known.name if known else f"UNKNOWN_ENUM_VALUE_{field.descriptor.enum_type.name}_{item}")
    if field.kind in _UNSIGNED_64 and item >= _HALF:
        return item - _WHOLE
    return item


def _to_protobuf(field: MessageField, given: Value, get: GetMessage) -> Any:
    """Return a value of CLIPS as a field takes it.

    :raises ProtobufError: when it is of another type.
    """
    kind = field.kind
    if kind == FieldDescriptor.TYPE_MESSAGE:
        found = get(given)
        if found is None:
            raise ProtobufError("the value is not a valid message")
        if found.DESCRIPTOR.full_name != field.of:
            raise ProtobufError(f"it takes {field.of}, not {found.DESCRIPTOR.full_name}")
        return found
    if kind == FieldDescriptor.TYPE_BOOL:
        return given == "TRUE"
    if kind in (FieldDescriptor.TYPE_STRING, FieldDescriptor.TYPE_ENUM):
        if not isinstance(given, str):
            raise ProtobufError(f"{given} is not a STRING or SYMBOL")
        return given if kind == FieldDescriptor.TYPE_STRING else _enum_number(field, given)
    if isinstance(given, bool) or not isinstance(given, int | float):
        raise ProtobufError(f"{given} is not a number")
    if kind in _FLOATS:
        return float(given)
    try:
        whole = int(given)
    except (OverflowError, ValueError):
        raise ProtobufError(f"{given} is not a whole number") from None
    return whole + _WHOLE if kind in _UNSIGNED_64 and -_HALF <= whole < 0 else whole


class UnknownEnumValueError(ProtobufError):
    """An enum has no value of that name."""


def _enum_number(field: MessageField, name: str) -> int:
    known = field.descriptor.enum_type.values_by_name.get(name)
    if known is None:
        raise UnknownEnumValueError(f"there is no '{name}' in {field.descriptor.enum_type.name}")
    return int(known.number)
