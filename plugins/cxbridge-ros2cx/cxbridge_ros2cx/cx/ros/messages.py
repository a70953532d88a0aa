"""The messages that rules have: each an address, its fields read and set by name.

The message within a message is a view: a field that is set there is set in the whole. A message that is put
into a field is moved, as in the original: its strings and lists are empty afterwards.
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

Fields = dict[str, Any]
"""The fields of a message; those of messages within it are mappings, too."""

_BITS: Final = {f"{sign}int{bits}": bits for bits in (8, 16, 32, 64) for sign in ("", "u")} | {
    "byte": 8,
    "char": 8,
    "octet": 8,
}
_FIRST_ADDRESS: Final = 0x5000_0000_1000
_STEP: Final = 0x40


class Addresses:
    """Addresses that are given out; one that was freed is used again, as in the original."""

    def __init__(self, first: int = _FIRST_ADDRESS) -> None:
        self._free: list[ExternalAddress] = []
        self._numbers = count(first, _STEP)

    def take(self) -> ExternalAddress:
        """Return a fresh address."""
        return self._free.pop() if self._free else ExternalAddress(next(self._numbers))

    def free(self, address: ExternalAddress) -> None:
        """Take an address back."""
        self._free.append(address)


class FieldError(ClipsError):
    """A field that there is not, or a value that it does not take."""


class MessageView(Struct, eq=False):
    """A message, or the part of one, at an address.

    :param parent: the message that has this one in a field; None: it is whole.
    """

    kind: TypeName
    fields: Fields
    parent: ExternalAddress | None = None


class MessageTable:
    """Messages by their addresses, of all environments.

    :param definitions: the types that are known.
    """

    def __init__(self, definitions: Definitions) -> None:
        self.definitions = definitions
        self._codec = Codec(definitions)
        self._views: dict[ExternalAddress, MessageView] = {}
        self._parts: dict[ExternalAddress, list[ExternalAddress]] = {}
        self._addresses = Addresses()

    def __len__(self) -> int:
        """Return how many whole messages there are."""
        return sum(view.parent is None for view in self._views.values())

    def create(self, kind: TypeName, given: Mapping[str, Any] | None = None) -> ExternalAddress:
        """Return the address of a new message; fields that are not given have their defaults.

        :raises Ros2Error: when there is no such type, or the given fields do not fit.
        """
        fields = self._codec.decode(kind, self._codec.encode(kind, given or {}))
        return self._add(MessageView(kind, fields))

    def take(self, kind: TypeName, fields: Fields) -> ExternalAddress:
        """Return the address of a message that has come."""
        return self._add(MessageView(kind, fields))

    def _add(self, view: MessageView) -> ExternalAddress:
        address = self._addresses.take()
        self._views[address] = view
        if view.parent is not None:
            self._parts.setdefault(view.parent, []).append(address)
        return address

    def find(self, address: ExternalAddress) -> MessageView:
        """Return the message at an address.

        :raises ClipsError: when there is none, e.g. no more.
        """
        view = self._views.get(address)
        if view is None:
            raise ClipsError("Invalid pointer: there is no message at this address, or no more")
        return view

    def destroy(self, address: ExternalAddress) -> None:
        """Forget a message, and the addresses of its parts; without one nothing happens."""
        if self._views.pop(address, None) is not None:
            self._addresses.free(address)
        for part in self._parts.pop(address, ()):
            self.destroy(part)

    def kind_of(self, view: MessageView, field: str) -> FieldType:
        """Return the type of a field.

        :raises FieldError: when there is no such field.
        """
        known = dict(self.definitions.fields(view.kind))
        if field not in known:
            raise FieldError(f"{view.kind} has no field '{field}'", hint=f"it has: {', '.join(known)}")
        return known[field]

    def get(self, address: ExternalAddress, field: str) -> Value:
        """Return the value of a field.

        :raises ClipsError: when there is no such message or field.
        """
        view = self.find(address)
        node, rest = kind = self.kind_of(view, field)
        value = view.fields[field]
        if node in (Nodetype.BASE, Nodetype.NAME):
            return self._read(address, kind, value)
        return tuple(self._read(address, rest[0], each) for each in value)

    def _read(self, address: ExternalAddress, kind: FieldType, value: Any) -> Value:
        node, rest = kind
        if node == Nodetype.NAME:
            return self._add(MessageView(parse_type(rest), value, address))
        if rest[0] == "bool":
            return TRUE if value else FALSE
        if rest[0] == "uint64" and value >= 1 << 63:
            return int(value) - (1 << 64)
        made: Value = value
        return made

    def set(self, address: ExternalAddress, field: str, value: Value) -> None:
        """Set a field.

        :raises ClipsError: when there is no such message or field, or the field takes no such value.
        """
        view = self.find(address)
        node, rest = kind = self.kind_of(view, field)
        if node in (Nodetype.BASE, Nodetype.NAME):
            view.fields[field] = self._written(kind, value, field, view.fields[field])
            return
        if not isinstance(value, Sequence) or isinstance(value, str):
            raise FieldError("expected multifield value!")
        of, most = rest
        if node == Nodetype.ARRAY and len(value) != most:
            raise FieldError(f"the field '{field}' takes {most} values, not {len(value)}")
        if node == Nodetype.SEQUENCE and most and len(value) > most:
            raise FieldError(f"the field '{field}' takes up to {most} values, not {len(value)}")
        view.fields[field] = [self._written(of, each, field, None) for each in value]

    def _written(self, kind: FieldType, value: Value, field: str, before: Any) -> Any:
        node, rest = kind
        if node == Nodetype.NAME:
            return self._moved(parse_type(rest), value, field, before)
        made = _CONVERT[rest[0]](value, rest[0])
        if made is None:
            raise FieldError(f"the field '{field}' of type {rest[0]} takes no {_shown(value)}")
        if isinstance(made, str) and rest[1] and len(made) > rest[1]:
            raise FieldError(f"the field '{field}' takes up to {rest[1]} characters, not {len(made)}")
        return made

    def _is_alike(self, one: TypeName, other: TypeName) -> bool:
        """Return whether two types have the same fields: the original checks nothing, agents know."""
        fields = self.definitions.fields
        return one == other or list(fields(one)) == list(fields(other))

    def _moved(self, kind: TypeName, value: Value, field: str, before: Any) -> Fields:
        """Return the fields of a message that is moved into another one."""
        view = self._views.get(value) if isinstance(value, ExternalAddress) else None
        if view is None:
            raise FieldError(f"Failed to set unknown message: the field '{field}' takes a {kind}")
        if not self._is_alike(view.kind, kind):
            raise FieldError(f"the field '{field}' takes a {kind}, not a {view.kind}")
        fields = dict(view.fields)
        _empty(view.fields)
        if isinstance(before, dict):  # views of the part stay views
            before.clear()
            before.update(fields)
            return before
        return fields


def _empty(fields: Fields) -> None:
    """Empty the strings and lists of a message that was moved."""
    for name, value in fields.items():
        if isinstance(value, str | list | bytes):
            fields[name] = type(value)()
        elif isinstance(value, dict):
            fields[name] = dict(value)
            _empty(fields[name])


def _shown(value: Value) -> str:
    return "external address" if isinstance(value, ExternalAddress) else repr(value)


def _bool(value: Value, _kind: str) -> bool | None:
    return value == "TRUE" if isinstance(value, str) else None


def _integer(value: Value, kind: str) -> int | None:
    """Return an integer as the field has room for; a FLOAT without a fraction is one."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int):
        return None
    bits = _BITS[kind]
    rest = value % (1 << bits)
    return rest - (1 << bits) if kind.startswith("int") and rest >> (bits - 1) else rest


def _double(value: Value, _kind: str) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def _single(value: Value, _kind: str) -> float | None:
    if not isinstance(value, int | float):
        return None
    try:
        found: float = struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        return None
    return found


def _text(value: Value, _kind: str) -> str | None:
    return str(value) if isinstance(value, str) else None


_CONVERT: Final[dict[str, Callable[[Value, str], Any]]] = {
    **dict.fromkeys(_BITS, _integer),
    "bool": _bool,
    "float32": _single,
    "float64": _double,
    "string": _text,
    "wstring": _text,
}
