"""Messages as plain Python values, and their CDR.

A message is a dict by field, as in JSON; nested messages are dicts, arrays are lists, and byte arrays
(``uint8[]``, ``byte[]``, ``char[]``) are ``bytes``. Missing fields have their defaults, as in ROS.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeAlias

import numpy as np
from rosbags.interfaces import Nodetype

from cxbridge.errors import Ros2Error
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.definitions import Definitions, FieldType
from cxbridge_ros2.names import TypeName, parse_type

Message = dict[str, Any]

_ENDIANNESS: Final = (b"\0\0", b"\0\1")
_HEADER: Final = 4  # bytes of the CDR encapsulation header
_PLACEHOLDER: Final = "structure_needs_at_least_one_member"
_BYTES: Final = ("uint8", "byte")
_INTEGERS: Final = {
    name: (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if name.startswith("int") else (0, 2**bits - 1)
    for bits in (8, 16, 32, 64)
    for name in (f"int{bits}", f"uint{bits}")
} | {"byte": (0, 255)}
_FLOAT32_MAX: Final = float(np.finfo(np.float32).max)
_DTYPES: Final = {
    **{name: name for name in (*_INTEGERS, "float32", "float64", "bool")},
    "byte": "uint8",
}


class Codec:
    """Encodes and decodes the messages of a set of definitions."""

    def __init__(self, definitions: Definitions) -> None:
        self._definitions = definitions
        self._store = definitions.store

    def encode(self, name: TypeName, message: Mapping[str, Any]) -> bytes:
        """Return a message as little-endian CDR with its four-byte header."""
        instance = self._make(name, message, str(name))
        return bytes(self._store.serialize_cdr(instance, str(name)))

    def decode(self, name: TypeName, data: bytes | memoryview) -> Message:
        """Return the message in CDR bytes. Extra bytes at the end are ignored, since some RMWs send them.

        :raises Ros2Error: if the bytes are not a message of this type.
        """
        self._definitions.fields(name)
        try:
            instance = self._read(name, data)
        except Exception:  # noqa: BLE001 - generated code raises many kinds of errors
            raise Ros2Error(f"{len(data)} bytes are not a {name}") from None
        return self._plain(name, instance)

    def _read(self, name: TypeName, data: bytes | memoryview) -> Any:
        """Deserialise a message; rosbags' own function rejects more than three extra bytes."""
        if bytes(data[:2]) not in _ENDIANNESS:
            raise ValueError("no plain CDR")
        definition = self._store.get_msgdef(str(name))
        read = definition.deserialize_cdr_le if data[1] else definition.deserialize_cdr_be
        instance, _end = read(data[_HEADER:], 0, definition.cls, self._store)
        return instance

    # --- to ROS -------------------------------------------------------------------------------------------

    def _make(self, name: TypeName, message: object, path: str) -> Any:
        if not isinstance(message, Mapping):
            raise Ros2Error(f"{path}: a {name} is a mapping of fields, not {message!r}")
        fields = dict(self._definitions.fields(name))
        for key in message:
            if key not in fields or key == _PLACEHOLDER:
                hint = did_you_mean(str(key), [each for each in fields if each != _PLACEHOLDER], "")
                raise Ros2Error(f"{path}: {name} has no field '{key}'", hint=hint or None)
        field_values = {**self._definitions.defaults(name), **message}
        values = [
            self._value(kind, field_values[field], f"{path}.{field}")
            if field in field_values
            else self._zero(kind)
            for field, kind in fields.items()
        ]
        return self._store.types[str(name)](*values)

    def _value(self, kind: FieldType, value: Any, path: str) -> Any:
        node, rest = kind
        if node == Nodetype.NAME:
            return self._make(parse_type(rest), value, path)
        if node == Nodetype.BASE:
            return _base(rest, value, path)
        return self._list(node, rest[0], rest[1], value, path)

    def _list(self, node: Nodetype, of: FieldType, count: int, given: Any, path: str) -> Any:
        if isinstance(given, str | Mapping) or not isinstance(
            given, Sequence | np.ndarray | bytearray | memoryview
        ):
            raise Ros2Error(f"{path}: a list is wanted, not {given!r}")
        if node == Nodetype.ARRAY and len(given) != count:
            raise Ros2Error(f"{path}: {count} elements are wanted, not {len(given)}")
        if node == Nodetype.SEQUENCE and count and len(given) > count:
            raise Ros2Error(f"{path}: at most {count} elements are possible, not {len(given)}")
        base = of[1][0] if of[0] == Nodetype.BASE else ""
        if base in _BYTES and isinstance(given, bytes | bytearray | memoryview):
            return np.frombuffer(bytes(given), dtype=np.uint8)
        values = [self._value(of, each, f"{path}[{index}]") for index, each in enumerate(given)]
        if base in _BYTES:
            return np.array([each & 0xFF for each in values], dtype=np.uint8)
        return np.array(values, dtype=_DTYPES[base]) if base in _DTYPES else values

    def _zero(self, kind: FieldType) -> Any:
        node, rest = kind
        if node == Nodetype.NAME:
            return self._make(parse_type(rest), {}, str(rest))
        if node == Nodetype.BASE:
            return _ZEROS.get(rest[0], 0)
        of, count = rest
        base = of[1][0] if of[0] == Nodetype.BASE else ""
        length = count if node == Nodetype.ARRAY else 0
        if base in _DTYPES:
            return np.zeros(length, dtype=_DTYPES[base])
        return [self._zero(of) for _ in range(length)]

    # --- from ROS -----------------------------------------------------------------------------------------

    def _plain(self, name: TypeName, instance: Any) -> Message:
        return {
            field: self._unmade(kind, getattr(instance, field if hasattr(instance, field) else f"{field}_"))
            for field, kind in self._definitions.fields(name)
            if field != _PLACEHOLDER
        }

    def _unmade(self, kind: FieldType, value: Any) -> Any:
        node, rest = kind
        if node == Nodetype.NAME:
            return self._plain(parse_type(rest), value)
        if node == Nodetype.BASE:
            return value & 0xFF if rest[0] == "byte" else value
        of = rest[0]
        if of[0] == Nodetype.NAME:
            name = parse_type(of[1])
            return [self._plain(name, each) for each in value]
        if of[1][0] in _BYTES:
            return bytes(value)
        return value.tolist() if isinstance(value, np.ndarray) else list(value)


def _base(kind: tuple[str, int], value: Any, path: str) -> Any:
    """Return a checked value for a field of a base type."""
    name, bound = kind
    return _CHECKS[name](value, path, name, bound)


def _integer(value: Any, path: str, name: str, _bound: int) -> int:
    low, high = _INTEGERS[name]
    whole = int(value) if isinstance(value, float) and value.is_integer() else value
    if isinstance(whole, np.integer):
        whole = int(whole)
    if isinstance(whole, bool) or not isinstance(whole, int):
        raise Ros2Error(f"{path}: a whole number is wanted ({name}), not {value!r}")
    if not low <= whole <= high:
        raise Ros2Error(f"{path}: {whole} does not fit into {name} ({low} to {high})")
    return whole


def _byte(value: Any, path: str, name: str, bound: int) -> int:
    whole = _integer(value, path, name, bound)
    return whole - 256 if whole > 127 else whole  # noqa: PLR2004 - rosbags writes a byte with a sign


def _float(given: Any, path: str, name: str, _bound: int) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float | np.number):
        raise Ros2Error(f"{path}: a number is wanted ({name}), not {given!r}")
    value = float(given)
    if name == "float32" and math.isfinite(value) and abs(value) > _FLOAT32_MAX:
        raise Ros2Error(f"{path}: {given} does not fit into float32")
    return value


def _boolean(value: Any, path: str, _name: str, _bound: int) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise Ros2Error(f"{path}: true or false is wanted, not {value!r}")
    return bool(value)


def _string(value: Any, path: str, _name: str, bound: int) -> str:
    if not isinstance(value, str):
        raise Ros2Error(f"{path}: a string is wanted, not {value!r}")
    if "\0" in value:
        raise Ros2Error(f"{path}: a string has no NUL in it")
    try:
        size = len(value.encode())
    except UnicodeEncodeError:
        raise Ros2Error(f"{path}: {value!r} is no Unicode text") from None
    if bound and size > bound:
        raise Ros2Error(f"{path}: at most {bound} bytes are possible, not {size}")
    return value


_Check: TypeAlias = Callable[[Any, str, str, int], Any]
_CHECKS: Final[dict[str, _Check]] = {
    **dict.fromkeys(_INTEGERS, _integer),
    "byte": _byte,
    "bool": _boolean,
    "string": _string,
    "float32": _float,
    "float64": _float,
}
_ZEROS: Final[dict[str, Any]] = {"bool": False, "string": "", "float32": 0.0, "float64": 0.0}
