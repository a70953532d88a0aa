"""Messages as plain Python values, and their CDR.

A message is a dict by field, as in JSON; nested messages are dicts, arrays are lists, and byte arrays
(``uint8[]``, ``byte[]``, ``char[]``) are ``bytes``. Missing fields have their defaults, as in ROS.

rosbags generates a class and two functions for each type, which neither check values nor convert them.
:class:`Codec` does both, for every transport.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from rosbags.interfaces import Nodetype

from cxbridge.errors import Ros2Error
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.definitions import Definitions, FieldType
from cxbridge_ros2.names import TypeName, parse_type

Message = dict[str, Any]

PLACEHOLDER: Final = "structure_needs_at_least_one_member"  # ROS' field of an empty message, on the wire
BYTE_TYPES: Final = ("uint8", "byte")

_ENDIANNESS: Final = (b"\0\0", b"\0\1")
_HEADER: Final = 4  # bytes of the CDR encapsulation header
_RANGES: Final = {
    name: (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if name.startswith("int") else (0, 2**bits - 1)
    for bits in (8, 16, 32, 64)
    for name in (f"int{bits}", f"uint{bits}")
} | {"byte": (0, 255)}
_FLOAT32_MAX: Final = float(np.finfo(np.float32).max)
_DTYPES: Final = {
    **{name: name for name in (*_RANGES, "float32", "float64", "bool")},
    "byte": "uint8",
}


class Codec:
    """Encodes and decodes the messages of a set of definitions."""

    def __init__(self, definitions: Definitions) -> None:
        self._definitions = definitions
        self._store = definitions.store

    def encode(self, name: TypeName, message: Mapping[str, Any]) -> bytes:
        """Return a message as little-endian CDR with its four-byte header.

        :raises Ros2Error: if the message does not fit the type.
        """
        return bytes(self._store.serialize_cdr(self._to_instance(name, message, str(name)), str(name)))

    def decode(self, name: TypeName, data: bytes | memoryview) -> Message:
        """Return the message in CDR bytes. Extra bytes at the end are ignored, since some RMWs send them.

        :raises Ros2Error: if the bytes are not a message of this type.
        """
        self._definitions.fields(name)
        try:
            instance = self._deserialize(name, data)
        except Exception:  # noqa: BLE001 - generated code raises many kinds of errors
            raise Ros2Error(f"{len(data)} bytes are not a {name}") from None
        return self._to_message(name, instance)

    def _deserialize(self, name: TypeName, data: bytes | memoryview) -> Any:
        """Deserialise a message; rosbags' own function rejects more than three extra bytes."""
        if bytes(data[:2]) not in _ENDIANNESS:
            raise ValueError("no plain CDR")
        definition = self._store.get_msgdef(str(name))
        deserialize = definition.deserialize_cdr_le if data[1] else definition.deserialize_cdr_be
        instance, _end = deserialize(data[_HEADER:], 0, definition.cls, self._store)
        return instance

    # --- to ROS -------------------------------------------------------------------------------------------

    def _to_instance(self, name: TypeName, message: object, path: str) -> Any:
        if not isinstance(message, Mapping):
            raise Ros2Error(f"{path}: a {name} is a mapping of fields, not {message!r}")
        fields = dict(self._definitions.fields(name))
        for key in message:
            if key not in fields or key == PLACEHOLDER:
                hint = did_you_mean(str(key), [field for field in fields if field != PLACEHOLDER])
                raise Ros2Error(f"{path}: {name} has no field '{key}'", hint=hint or None)
        field_values = {**self._definitions.defaults(name), **message}
        values = [
            self._to_ros(kind, field_values[field], f"{path}.{field}")
            if field in field_values
            else self._zero(kind)
            for field, kind in fields.items()
        ]
        return self._store.types[str(name)](*values)

    def _to_ros(self, kind: FieldType, value: Any, path: str) -> Any:
        node, details = kind
        if node == Nodetype.NAME:
            return self._to_instance(parse_type(details), value, path)
        if node == Nodetype.BASE:
            name, limit = details
            return _CHECKS[name](value, path, name, limit)
        element, size = details
        return self._to_ros_list(node, element, size, value, path)

    def _to_ros_list(self, node: Nodetype, element: FieldType, size: int, values: Any, path: str) -> Any:
        if isinstance(values, str | Mapping) or not isinstance(
            values, Sequence | np.ndarray | bytearray | memoryview
        ):
            raise Ros2Error(f"{path}: a list is wanted, not {values!r}")
        if node == Nodetype.ARRAY and len(values) != size:
            raise Ros2Error(f"{path}: {size} elements are wanted, not {len(values)}")
        if node == Nodetype.SEQUENCE and size and len(values) > size:
            raise Ros2Error(f"{path}: at most {size} elements are possible, not {len(values)}")
        base = _base_type(element)
        if base in BYTE_TYPES and isinstance(values, bytes | bytearray | memoryview):
            return np.frombuffer(bytes(values), dtype=np.uint8)  # no check: a byte always fits
        elements = [self._to_ros(element, value, f"{path}[{index}]") for index, value in enumerate(values)]
        if base in BYTE_TYPES:
            return np.array([number & 0xFF for number in elements], dtype=np.uint8)
        return np.array(elements, dtype=_DTYPES[base]) if base in _DTYPES else elements

    def _zero(self, kind: FieldType) -> Any:
        node, details = kind
        if node == Nodetype.NAME:
            return self._to_instance(parse_type(details), {}, str(details))
        if node == Nodetype.BASE:
            return _ZEROS.get(details[0], 0)
        element, size = details
        base = _base_type(element)
        length = size if node == Nodetype.ARRAY else 0
        if base in _DTYPES:
            return np.zeros(length, dtype=_DTYPES[base])
        return [self._zero(element) for _ in range(length)]

    # --- from ROS -----------------------------------------------------------------------------------------

    def _to_message(self, name: TypeName, instance: Any) -> Message:
        return {
            # rosbags appends _ to fields that are keywords of Python
            field: self._from_ros(kind, getattr(instance, field if hasattr(instance, field) else f"{field}_"))
            for field, kind in self._definitions.fields(name)
            if field != PLACEHOLDER
        }

    def _from_ros(self, kind: FieldType, value: Any) -> Any:
        node, details = kind
        if node == Nodetype.NAME:
            return self._to_message(parse_type(details), value)
        if node == Nodetype.BASE:
            return value & 0xFF if details[0] == "byte" else value
        element_node, element_details = details[0]
        if element_node == Nodetype.NAME:
            name = parse_type(element_details)
            return [self._to_message(name, instance) for instance in value]
        if element_details[0] in BYTE_TYPES:
            return bytes(value)
        return value.tolist() if isinstance(value, np.ndarray) else list(value)


def _base_type(kind: FieldType) -> str:
    """Return the name of a base type; empty for other types."""
    node, details = kind
    return str(details[0]) if node == Nodetype.BASE else ""


def value_at(message: Any, path: str) -> Any:
    """Return the value at a dotted path of a message; None if the message has no such field."""
    for field in path.split("."):
        if not isinstance(message, Mapping) or field not in message:
            return None
        message = message[field]
    return message


# --- checks of base types -----------------------------------------------------------------------------------


def _integer(value: Any, path: str, name: str, _limit: int) -> int:
    low, high = _RANGES[name]
    # JSON and YAML may write a whole number as 1.0
    number = int(value) if isinstance(value, float) and value.is_integer() else value
    if isinstance(number, np.integer):
        number = int(number)
    if isinstance(number, bool) or not isinstance(number, int):
        raise Ros2Error(f"{path}: a whole number is wanted ({name}), not {value!r}")
    if not low <= number <= high:
        raise Ros2Error(f"{path}: {number} does not fit into {name} ({low} to {high})")
    return number


def _byte(value: Any, path: str, name: str, limit: int) -> int:
    number = _integer(value, path, name, limit)
    return number - 256 if number > 127 else number  # noqa: PLR2004 - rosbags writes a byte with a sign


def _float(value: Any, path: str, name: str, _limit: int) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise Ros2Error(f"{path}: a number is wanted ({name}), not {value!r}")
    number = float(value)
    if name == "float32" and math.isfinite(number) and abs(number) > _FLOAT32_MAX:
        raise Ros2Error(f"{path}: {value} does not fit into float32")
    return number


def _boolean(value: Any, path: str, _name: str, _limit: int) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise Ros2Error(f"{path}: true or false is wanted, not {value!r}")
    return bool(value)


def _string(value: Any, path: str, _name: str, limit: int) -> str:
    if not isinstance(value, str):
        raise Ros2Error(f"{path}: a string is wanted, not {value!r}")
    if "\0" in value:  # C++ nodes would read the text up to the NUL
        raise Ros2Error(f"{path}: a string has no NUL in it")
    try:
        size = len(value.encode())
    except UnicodeEncodeError:
        raise Ros2Error(f"{path}: {value!r} is no Unicode text") from None
    if limit and size > limit:
        raise Ros2Error(f"{path}: at most {limit} bytes are possible, not {size}")
    return value


# By base type: returns the checked value of a field with this path and type.
_CHECKS: Final[dict[str, Callable[[Any, str, str, int], Any]]] = {
    **dict.fromkeys(_RANGES, _integer),
    "byte": _byte,
    "bool": _boolean,
    "string": _string,
    "float32": _float,
    "float64": _float,
}
_ZEROS: Final[dict[str, Any]] = {"bool": False, "string": "", "float32": 0.0, "float64": 0.0}
