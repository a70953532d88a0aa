"""The ROS messages that rules create and receive, each at an address.

Functions for rules read and set fields by name. A nested message has its own address; a change to its field
changes the message that contains it. As in the ROS 2 CX, a message that becomes the value of a field is
moved: its strings and lists are empty afterwards.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
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

_BIT_WIDTHS: Final = {f"{sign}int{bits}": bits for bits in (8, 16, 32, 64) for sign in ("", "u")} | {
    "byte": 8,
    "char": 8,
    "octet": 8,
}
# Fixed numbers in place of real addresses: CLIPS prints addresses, and a repeated run must print the same.
# The step is chosen freely.
_FIRST_ADDRESS: Final = 0x5000_0000_1000
_ADDRESS_STEP: Final = 0x40


def count_addresses(first: int = _FIRST_ADDRESS) -> Iterator[ExternalAddress]:
    """Yield addresses, each once."""
    return map(ExternalAddress, count(first, _ADDRESS_STEP))


class FieldError(ClipsError):
    """An unknown field, or a value that does not fit its type."""


class MessageView(Struct, eq=False):
    """A view of the message at an address, which may be nested in another message.

    :param fields: the fields of the message itself: a change changes the message.
    :param parent: the address of the message that contains this message; None for a whole message.
    """

    type_name: TypeName
    fields: Fields
    parent: ExternalAddress | None = None


class MessageTable:
    """The messages of all environments by address.

    :param definitions: the definitions of ROS types.
    """

    def __init__(self, definitions: Definitions) -> None:
        self.definitions = definitions
        self._codec = Codec(definitions)
        self._views: dict[ExternalAddress, MessageView] = {}
        self._nested_addresses: dict[ExternalAddress, list[ExternalAddress]] = {}
        self._addresses = count_addresses()

    def __len__(self) -> int:
        """Return the number of whole messages."""
        return sum(view.parent is None for view in self._views.values())

    def create(self, type_name: TypeName, field_values: Mapping[str, Any] | None = None) -> ExternalAddress:
        """Return the address of a new message, with defaults for the missing fields.

        :raises Ros2Error: if the type is unknown, or a field does not fit.
        """
        # encoding and decoding checks the given fields and adds the missing fields
        encoded_message = self._codec.encode(type_name, field_values or {})
        return self.add_received(type_name, self._codec.decode(type_name, encoded_message))

    def add_received(self, type_name: TypeName, fields: Fields) -> ExternalAddress:
        """Return the address of a received message, without a copy."""
        return self._add_view(MessageView(type_name, fields))

    def _add_view(self, view: MessageView) -> ExternalAddress:
        address = next(self._addresses)
        self._views[address] = view
        if view.parent is not None:
            self._nested_addresses.setdefault(view.parent, []).append(address)
        return address

    def find(self, address: ExternalAddress) -> MessageView:
        """Return the message at an address.

        :raises ClipsError: if the address is unknown, e.g. already freed.
        """
        view = self._views.get(address)
        if view is None:
            raise ClipsError("Invalid pointer: the address is that of no message, or of a destroyed message")
        return view

    def destroy(self, address: ExternalAddress) -> None:
        """Remove a message and its nested messages; unknown addresses are ignored."""
        self._views.pop(address, None)
        for nested_address in self._nested_addresses.pop(address, ()):
            self.destroy(nested_address)

    def find_field_type(self, view: MessageView, field: str) -> FieldType:
        types = dict(self.definitions.find_fields(view.type_name))
        if field not in types:
            raise FieldError(f"{view.type_name} has no field '{field}'", hint=f"it has: {', '.join(types)}")
        return types[field]

    def get(self, address: ExternalAddress, field: str) -> Value:
        """Return the value of a field.

        :raises FieldError: if the field is unknown.
        :raises ClipsError: if the message is unknown.
        """
        view = self.find(address)
        match self.find_field_type(view, field):
            case (Nodetype.ARRAY | Nodetype.SEQUENCE, (element_type, _max_length)):
                return tuple(
                    self._to_clips_value(address, element_type, element) for element in view.fields[field]
                )
            case field_type:
                return self._to_clips_value(address, field_type, view.fields[field])

    def _to_clips_value(self, address: ExternalAddress, field_type: FieldType, value: Any) -> Value:
        """Return the value of a field for rules; a nested message gets an address.

        :param address: the address of the message that has the field.
        """
        kind, details = field_type
        if kind == Nodetype.NAME:
            return self._add_view(MessageView(parse_type(details), value, address))
        base_type, _max_length = details
        if base_type == "bool":
            return TRUE if value else FALSE
        # CLIPS has only signed 64-bit integers: larger values wrap around, as in C++
        clips_value: Value = value - (1 << 64) if base_type == "uint64" and value >= 1 << 63 else value
        return clips_value

    def set(self, address: ExternalAddress, field: str, value: Value) -> None:
        """Set a field.

        :raises FieldError: if the field is unknown, or the value does not fit.
        :raises ClipsError: if the message is unknown.
        """
        view = self.find(address)
        kind, details = field_type = self.find_field_type(view, field)
        if kind in (Nodetype.BASE, Nodetype.NAME):
            view.fields[field] = self._to_field_value(field_type, value, field, view.fields[field])
            return
        if not isinstance(value, Sequence) or isinstance(value, str):
            # the text of the ROS 2 CX; the caller adds the name of the field
            raise FieldError("expected multifield value!")
        element_type, max_length = details  # without a limit, a sequence has the maximum 0
        if kind == Nodetype.ARRAY and len(value) != max_length:
            raise FieldError(f"the field '{field}' takes {max_length} values, not {len(value)}")
        if kind == Nodetype.SEQUENCE and max_length and len(value) > max_length:
            raise FieldError(f"the field '{field}' takes up to {max_length} values, not {len(value)}")
        view.fields[field] = [self._to_field_value(element_type, element, field, None) for element in value]

    def _to_field_value(self, field_type: FieldType, value: Value, field: str, previous: Any) -> Any:
        """Return the value of a field for a CLIPS value.

        :param previous: the present value of the field; None for an element of a list.
        :raises FieldError: if the CLIPS value does not fit.
        """
        kind, details = field_type
        if kind == Nodetype.NAME:
            return self._move_fields(parse_type(details), value, field, previous)
        base_type, max_length = details
        field_value = _CONVERTERS[base_type](value, base_type)
        if field_value is None:
            raise FieldError(f"the field '{field}' of type {base_type} cannot be {_describe_value(value)}")
        if isinstance(field_value, str) and max_length and len(field_value) > max_length:
            raise FieldError(
                f"the field '{field}' takes up to {max_length} characters, not {len(field_value)}"
            )
        return field_value

    def _move_fields(self, type_name: TypeName, value: Value, field: str, previous: Any) -> Fields:
        """Return the fields of the message at the address `value`, and empty that message.

        :raises FieldError: if there is no message at the address, or the message has another type.
        """
        view = self._views.get(value) if isinstance(value, ExternalAddress) else None
        if view is None:
            raise FieldError(
                f"the field '{field}' takes a message of type {type_name}, not {_describe_value(value)}"
            )
        # the ROS 2 CX does not compare the types, and agents exchange messages of types with the same fields
        find_fields = self.definitions.find_fields
        if view.type_name != type_name and [*find_fields(view.type_name)] != [*find_fields(type_name)]:
            raise FieldError(f"the field '{field}' takes a {type_name}, not a {view.type_name}")
        fields = dict(view.fields)
        _clear_fields(view.fields)
        # the same mapping gets the new fields, so that addresses of nested messages stay valid
        if isinstance(previous, dict):
            previous.clear()
            previous.update(fields)
            return previous
        return fields


def _clear_fields(fields: Fields) -> None:
    """Empty the strings and lists of a moved message."""
    for name, value in fields.items():
        if isinstance(value, str | list | bytes):
            fields[name] = type(value)()
        elif isinstance(value, dict):
            fields[name] = dict(value)  # a copy, because the receiving message has the mapping
            _clear_fields(fields[name])


def _describe_value(value: Value) -> str:
    return "an external address" if isinstance(value, ExternalAddress) else repr(value)


def _to_bool(value: Value, _type_name: str) -> bool | None:
    return value == "TRUE" if isinstance(value, str) else None  # as in the ROS 2 CX, other symbols are false


def _to_integer(value: Value, type_name: str) -> int | None:
    """Return an integer wrapped to the field's width; a FLOAT without a fraction is accepted."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int):
        return None
    size = 1 << _BIT_WIDTHS[type_name]
    wrapped_value = value % size
    is_negative = type_name.startswith("int") and wrapped_value >= size // 2
    return wrapped_value - size if is_negative else wrapped_value


def _to_float64(value: Value, _type_name: str) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def _to_float32(value: Value, _type_name: str) -> float | None:
    if not isinstance(value, int | float):
        return None
    try:
        (rounded_value,) = struct.unpack("<f", struct.pack("<f", value))
    except OverflowError:
        return None
    return float(rounded_value)


def _to_string(value: Value, _type_name: str) -> str | None:
    return str(value) if isinstance(value, str) else None


# functions by the type of a field: each converts a CLIPS value, and returns None if the value does not fit
_CONVERTERS: Final[dict[str, Callable[[Value, str], Any]]] = {
    **dict.fromkeys(_BIT_WIDTHS, _to_integer),
    "bool": _to_bool,
    "float32": _to_float32,
    "float64": _to_float64,
    "string": _to_string,
    "wstring": _to_string,
}
