"""Messages as plain Python values, and their encoding as CDR (DDS' Common Data Representation).

A message is a dict of its fields, as in JSON. Nested messages are dicts, arrays are lists, and byte arrays
(``uint8[]``, ``byte[]``, ``char[]``) are ``bytes``. A missing field gets its default, as in ROS.

rosbags generates a class for each type, and functions that read and write its CDR. These neither check values
nor convert them; :class:`Codec` does both.
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

# the field that ROS adds to a message without fields, since CDR has no empty structures
EMPTY_MESSAGE_FIELD: Final = "structure_needs_at_least_one_member"
BYTE_TYPES: Final = ("uint8", "byte")  # without char, which Definitions replaces by uint8

_CDR_IDENTIFIERS: Final = (b"\0\0", b"\0\1")  # big-endian and little-endian CDR
_HEADER_BYTES: Final = 4  # the encapsulation header has the identifier, and options
_INTEGER_RANGES: Final = {
    name: (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if name.startswith("int") else (0, 2**bits - 1)
    for bits in (8, 16, 32, 64)
    for name in (f"int{bits}", f"uint{bits}")
} | {"byte": (0, 255)}
_FLOAT32_MAX: Final = float(np.finfo(np.float32).max)
_DTYPES: Final = {
    **{name: name for name in (*_INTEGER_RANGES, "float32", "float64", "bool")},
    "byte": "uint8",
}


class Codec:
    """Encodes and decodes the messages of a set of definitions."""

    def __init__(self, definitions: Definitions) -> None:
        self._definitions = definitions
        self._store = definitions.store

    def encode(self, name: TypeName, message: Mapping[str, Any]) -> bytes:
        """Return a message as little-endian CDR with its encapsulation header.

        :raises Ros2Error: if the type is unknown, or the message does not fit it.
        """
        return bytes(self._store.serialize_cdr(self._to_instance(name, message, str(name)), str(name)))

    def decode(self, name: TypeName, encoded_message: bytes | memoryview) -> Message:
        """Return the message in CDR bytes. Extra bytes at the end are ignored, since some RMWs send them.

        :raises Ros2Error: if the type is unknown, or the bytes are not a message of this type.
        """
        self._definitions.find_fields(name)  # loads the type into the store
        try:
            instance = self._deserialize(name, encoded_message)
        except Exception:  # noqa: BLE001 - generated code raises many kinds of errors
            raise Ros2Error(f"{len(encoded_message)} bytes are not a {name}") from None
        return self._to_message(name, instance)

    def _deserialize(self, name: TypeName, encoded_message: bytes | memoryview) -> Any:
        """Deserialise a message with the generated function of its type.

        rosbags' public function is not used, since it rejects more than three extra bytes.
        """
        if bytes(encoded_message[:2]) not in _CDR_IDENTIFIERS:
            raise ValueError("not plain CDR")
        definition = self._store.get_msgdef(str(name))
        # the second byte of the identifier is 1 for little-endian CDR
        deserialize = definition.deserialize_cdr_le if encoded_message[1] else definition.deserialize_cdr_be
        instance, _end = deserialize(encoded_message[_HEADER_BYTES:], 0, definition.cls, self._store)
        return instance

    # --- to ROS -------------------------------------------------------------------------------------------

    def _to_instance(self, name: TypeName, message: object, path: str) -> Any:
        """Return a checked message as an instance of the class that rosbags has generated for its type.

        :param path: the path of the message in the outer message, for errors.
        :raises Ros2Error: if the message does not fit the type.
        """
        if not isinstance(message, Mapping):
            raise Ros2Error(f"{path} must be a mapping of the fields of {name}, not {message!r}")
        fields = dict(self._definitions.find_fields(name))
        for key in message:
            if key not in fields or key == EMPTY_MESSAGE_FIELD:
                hint = did_you_mean(str(key), [field for field in fields if field != EMPTY_MESSAGE_FIELD])
                raise Ros2Error(f"{path}: {name} has no field '{key}'", hint=hint or None)
        field_values = {**self._definitions.find_defaults(name), **message}
        attribute_values = [
            self._to_ros(
                field_type,
                field_values[field] if field in field_values else _make_zero(field_type),
                f"{path}.{field}",
            )
            for field, field_type in fields.items()
        ]
        return self._store.types[str(name)](*attribute_values)

    def _to_ros(self, field_type: FieldType, value: Any, path: str) -> Any:
        kind, details = field_type
        if kind == Nodetype.NAME:
            return self._to_instance(parse_type(details), value, path)
        if kind == Nodetype.BASE:
            name, limit = details
            return _CONVERTERS_BY_TYPE[name](value, path, name, limit)
        element_type, size = details
        return self._to_ros_list(kind, element_type, size, value, path)

    def _to_ros_list(self, kind: Nodetype, element_type: FieldType, size: int, values: Any, path: str) -> Any:
        if isinstance(values, str | Mapping) or not isinstance(
            values, Sequence | np.ndarray | bytearray | memoryview
        ):
            raise Ros2Error(f"{path} must be a list, not {values!r}")
        if kind == Nodetype.ARRAY and len(values) != size:
            raise Ros2Error(f"{path} must have {size} elements, not {len(values)}")
        if kind == Nodetype.SEQUENCE and size and len(values) > size:
            raise Ros2Error(f"{path} must have at most {size} elements, not {len(values)}")
        base_type = _find_base_type_name(element_type)
        if base_type in BYTE_TYPES and isinstance(values, bytes | bytearray | memoryview):
            return np.frombuffer(bytes(values), dtype=np.uint8)  # without checks, since each byte fits
        elements = [
            self._to_ros(element_type, value, f"{path}[{index}]") for index, value in enumerate(values)
        ]
        if base_type in BYTE_TYPES:
            # the mask removes the sign that `_convert_byte` gives to numbers above 127
            return np.array([number & 0xFF for number in elements], dtype=np.uint8)
        return np.array(elements, dtype=_DTYPES[base_type]) if base_type in _DTYPES else elements

    # --- from ROS -----------------------------------------------------------------------------------------

    def _to_message(self, name: TypeName, instance: Any) -> Message:
        return {
            # rosbags appends _ to fields that are keywords of Python
            field: self._to_python(
                field_type, getattr(instance, field if hasattr(instance, field) else f"{field}_")
            )
            for field, field_type in self._definitions.find_fields(name)
            if field != EMPTY_MESSAGE_FIELD
        }

    def _to_python(self, field_type: FieldType, value: Any) -> Any:
        match field_type:
            case (Nodetype.NAME, message_name):
                return self._to_message(parse_type(message_name), value)
            case (Nodetype.BASE, (base_type, _)):
                return value & 0xFF if base_type == "byte" else value  # rosbags reads a byte with a sign
            case (_, ((Nodetype.NAME, message_name), _)):  # an array or a sequence of messages
                element_name = parse_type(message_name)
                return [self._to_message(element_name, instance) for instance in value]
            case (_, ((_, (base_type, _)), _)) if base_type in BYTE_TYPES:  # an array or a sequence of bytes
                return bytes(value)
        return value.tolist() if isinstance(value, np.ndarray) else list(value)


def _make_zero(field_type: FieldType) -> Any:
    """Return the value of a missing field without a default."""
    match field_type:
        case (Nodetype.NAME, _):
            return {}
        case (Nodetype.BASE, (base_type, _)):
            return _ZEROS_BY_TYPE.get(base_type, 0)
        case (Nodetype.ARRAY, (element_type, size)):
            return [_make_zero(element_type)] * size
    return []


def _find_base_type_name(field_type: FieldType) -> str:
    """Return the name of a base type; empty for a message or a list."""
    match field_type:
        case (Nodetype.BASE, (base_type, _)):
            return str(base_type)
    return ""


def find_value(message: Any, path: str) -> Any:
    """Return the value of a field; None if the message has no such field.

    :param path: the path of the field, such as ``header.stamp``.
    """
    for field in path.split("."):
        if not isinstance(message, Mapping) or field not in message:
            return None
        message = message[field]
    return message


# --- conversion of base types -------------------------------------------------------------------------------


def _convert_integer(value: Any, path: str, name: str, _limit: int) -> int:
    low, high = _INTEGER_RANGES[name]
    # JSON and YAML may write a whole number as 1.0
    is_whole = isinstance(value, int | np.integer) or (isinstance(value, float) and value.is_integer())
    if isinstance(value, bool) or not is_whole:
        raise Ros2Error(f"{path} must be a whole number ({name}), not {value!r}")
    if not low <= value <= high:
        raise Ros2Error(f"{path}: {value} does not fit into {name} ({low} to {high})")
    return int(value)


def _convert_byte(value: Any, path: str, name: str, limit: int) -> int:
    number = _convert_integer(value, path, name, limit)
    return number - 256 if number > 127 else number  # noqa: PLR2004 - rosbags writes a byte with a sign


def _convert_float(value: Any, path: str, name: str, _limit: int) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise Ros2Error(f"{path} must be a number ({name}), not {value!r}")
    number = float(value)
    if name == "float32" and math.isfinite(number) and abs(number) > _FLOAT32_MAX:
        raise Ros2Error(f"{path}: {value} does not fit into float32")
    return number


def _convert_boolean(value: Any, path: str, _name: str, _limit: int) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise Ros2Error(f"{path} must be true or false, not {value!r}")
    return bool(value)


def _convert_string(value: Any, path: str, _name: str, limit: int) -> str:
    if not isinstance(value, str):
        raise Ros2Error(f"{path} must be a string, not {value!r}")
    if "\0" in value:  # C++ nodes would read the text up to the NUL
        raise Ros2Error(f"{path} must not contain a NUL")
    try:
        size = len(value.encode())
    except UnicodeEncodeError:
        raise Ros2Error(f"{path}: {value!r} is not valid Unicode") from None
    if limit and size > limit:
        raise Ros2Error(f"{path} must have at most {limit} bytes, not {size}")
    return value


# Functions by base type. A function returns a value as rosbags writes it, or raises `Ros2Error` if the value
# does not fit. The arguments are the value, the path of the field for errors, the base type, and the maximum
# number of bytes of a string, or 0 for no limit.
_CONVERTERS_BY_TYPE: Final[dict[str, Callable[[Any, str, str, int], Any]]] = {
    **dict.fromkeys(_INTEGER_RANGES, _convert_integer),
    "byte": _convert_byte,
    "bool": _convert_boolean,
    "string": _convert_string,
    "float32": _convert_float,
    "float64": _convert_float,
}
_ZEROS_BY_TYPE: Final[dict[str, Any]] = {"bool": False, "string": "", "float32": 0.0, "float64": 0.0}
