"""The messages of rules: each has an address; fields are read and set by name.

A nested message is a view: a change to its field changes the whole message. As in the original, a
message that is put into a field is moved: its strings and lists are empty afterwards.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from itertools import count
from typing import Any, Final

from msgspec import Struct
from rosbags.interfaces import Nodetype

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Value
from cxbridge_ros2.definitions import Definitions, FieldType
from cxbridge_ros2.messages import Codec
from cxbridge_ros2.names import TypeName, parse_type

Fields = dict[str, Any]  # fields of a message; nested messages are mappings, too

_BITS: Final = {f"{sign}int{bits}": bits for bits in (8, 16, 32, 64) for sign in ("", "u")} | {
    "byte": 8,
    "char": 8,
    "octet": 8,
}
# fixed numbers, since CLIPS prints addresses: a repeated run has the same output
_FIRST_ADDRESS: Final = 0x5000_0000_1000
_STEP: Final = 0x40


class Addresses:
    """Allocates addresses; freed addresses are reused, as in the original."""

    def __init__(self, first: int = _FIRST_ADDRESS) -> None:
        self._free: list[ExternalAddress] = []
        self._numbers = count(first, _STEP)

    def take(self) -> ExternalAddress:
        return self._free.pop() if self._free else ExternalAddress(next(self._numbers))

    def free(self, address: ExternalAddress) -> None:
        self._free.append(address)


class FieldError(ClipsError):
    """An unknown field, or a value that does not fit its type."""


class MessageView(Struct, eq=False):
    """A message, or a part of one, at an address.

    :param parent: the message that contains this one; None for a whole message.
    """

    kind: TypeName
    fields: Fields
    parent: ExternalAddress | None = None


class MessageTable:
    """The messages of all environments by address.

    :param definitions: the known types.
    """

    def __init__(self, definitions: Definitions) -> None:
        self.definitions = definitions
        self._codec = Codec(definitions)
        self._views: dict[ExternalAddress, MessageView] = {}
        self._nested: dict[ExternalAddress, list[ExternalAddress]] = {}
        self._addresses = Addresses()

    def __len__(self) -> int:
        """Return the number of whole messages."""
        return sum(view.parent is None for view in self._views.values())

    def create(self, kind: TypeName, field_values: Mapping[str, Any] | None = None) -> ExternalAddress:
        """Return the address of a new message, with defaults for the missing fields.

        :raises Ros2Error: if the type is unknown, or a field does not fit.
        """
        # encoded and decoded again: that checks the fields and adds the missing ones
        fields = self._codec.decode(kind, self._codec.encode(kind, field_values or {}))
        return self._add(MessageView(kind, fields))

    def take(self, kind: TypeName, fields: Fields) -> ExternalAddress:
        """Return the address of a received message, without a copy."""
        return self._add(MessageView(kind, fields))

    def _add(self, view: MessageView) -> ExternalAddress:
        address = self._addresses.take()
        self._views[address] = view
        if view.parent is not None:
            self._nested.setdefault(view.parent, []).append(address)
        return address

    def find(self, address: ExternalAddress) -> MessageView:
        """Return the message at an address.

        :raises ClipsError: if the address is unknown, e.g. already freed.
        """
        view = self._views.get(address)
        if view is None:
            raise ClipsError("Invalid pointer: there is no message at this address, or no more")
        return view

    def destroy(self, address: ExternalAddress) -> None:
        """Remove a message and the addresses of its parts; unknown addresses are ignored."""
        if self._views.pop(address, None) is not None:
            self._addresses.free(address)
        for nested in self._nested.pop(address, ()):
            self.destroy(nested)

    def kind_of(self, view: MessageView, field: str) -> FieldType:
        types = dict(self.definitions.fields(view.kind))
        if field not in types:
            raise FieldError(f"{view.kind} has no field '{field}'", hint=f"it has: {', '.join(types)}")
        return types[field]

    def get(self, address: ExternalAddress, field: str) -> Value:
        """Return the value of a field.

        :raises ClipsError: if the message or field is unknown.
        """
        view = self.find(address)
        node, details = kind = self.kind_of(view, field)
        value = view.fields[field]
        if node in (Nodetype.BASE, Nodetype.NAME):
            return self._read(address, kind, value)
        return tuple(self._read(address, details[0], element) for element in value)

    def _read(self, address: ExternalAddress, kind: FieldType, value: Any) -> Value:
        node, details = kind
        if node == Nodetype.NAME:
            return self._add(MessageView(parse_type(details), value, address))
        if details[0] == "bool":
            return TRUE if value else FALSE
        # CLIPS has signed 64-bit integers only
        if details[0] == "uint64" and value >= 1 << 63:
            return int(value) - (1 << 64)
        clips_value: Value = value
        return clips_value

    def set(self, address: ExternalAddress, field: str, value: Value) -> None:
        """Set a field.

        :raises ClipsError: if the message or field is unknown, or the value does not fit.
        """
        view = self.find(address)
        node, details = kind = self.kind_of(view, field)
        if node in (Nodetype.BASE, Nodetype.NAME):
            view.fields[field] = self._convert(kind, value, field, view.fields[field])
            return
        if not isinstance(value, Sequence) or isinstance(value, str):
            raise FieldError("expected multifield value!")
        element_type, max_length = details
        if node == Nodetype.ARRAY and len(value) != max_length:
            raise FieldError(f"the field '{field}' takes {max_length} values, not {len(value)}")
        if node == Nodetype.SEQUENCE and max_length and len(value) > max_length:
            raise FieldError(f"the field '{field}' takes up to {max_length} values, not {len(value)}")
        view.fields[field] = [self._convert(element_type, element, field, None) for element in value]

    def _convert(self, kind: FieldType, value: Value, field: str, previous: Any) -> Any:
        node, details = kind
        if node == Nodetype.NAME:
            return self._move_fields(parse_type(details), value, field, previous)
        converted = _CONVERT[details[0]](value, details[0])
        if converted is None:
            raise FieldError(f"the field '{field}' of type {details[0]} takes no {_text_of(value)}")
        if isinstance(converted, str) and details[1] and len(converted) > details[1]:
            raise FieldError(f"the field '{field}' takes up to {details[1]} characters, not {len(converted)}")
        return converted

    def _have_same_fields(self, kind: TypeName, field_kind: TypeName) -> bool:
        """Return whether two types have the same fields.

        The original checks no types, and agents rely on that.
        """
        fields = self.definitions.fields
        return kind == field_kind or list(fields(kind)) == list(fields(field_kind))

    def _move_fields(self, kind: TypeName, value: Value, field: str, previous: Any) -> Fields:
        """Return the fields of the message at an address, and empty that message."""
        view = self._views.get(value) if isinstance(value, ExternalAddress) else None
        if view is None:
            raise FieldError(f"Failed to set unknown message: the field '{field}' takes a {kind}")
        if not self._have_same_fields(view.kind, kind):
            raise FieldError(f"the field '{field}' takes a {kind}, not a {view.kind}")
        fields = dict(view.fields)
        _empty(view.fields)
        if isinstance(previous, dict):  # the same mapping, so that addresses of nested messages stay valid
            previous.clear()
            previous.update(fields)
            return previous
        return fields


def _empty(fields: Fields) -> None:
    """Empty the strings and lists of a moved message."""
    for name, value in fields.items():
        if isinstance(value, str | list | bytes):
            fields[name] = type(value)()
        elif isinstance(value, dict):
            fields[name] = dict(value)
            _empty(fields[name])


def _text_of(value: Value) -> str:
    return "external address" if isinstance(value, ExternalAddress) else repr(value)


def _bool(value: Value, _kind: str) -> bool | None:
    return value == "TRUE" if isinstance(value, str) else None


def _integer(value: Value, kind: str) -> int | None:
    """Return an integer wrapped to the field's width; a FLOAT without a fraction is accepted."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int):
        return None
    bits = _BITS[kind]
    wrapped = value % (1 << bits)
    return wrapped - (1 << bits) if kind.startswith("int") and wrapped >> (bits - 1) else wrapped


def _double(value: Value, _kind: str) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def _single(value: Value, _kind: str) -> float | None:
    if not isinstance(value, int | float):
        return None
    try:
        single: float = struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        return None
    return single


def _text(value: Value, _kind: str) -> str | None:
    return str(value) if isinstance(value, str) else None


# by type of the field: a function that returns the field's value; None if the CLIPS value does not fit
_CONVERT: Final[dict[str, Callable[[Value, str], Any]]] = {
    **dict.fromkeys(_BITS, _integer),
    "bool": _bool,
    "float32": _single,
    "float64": _double,
    "string": _text,
    "wstring": _text,
}
