"""Messages as plain Python values, to and from CDR.

A message is a mapping by field names, as in JSON or YAML; nested messages are mappings, arrays are lists, and
arrays of bytes (``uint8[]``, ``byte[]``, ``char[]``) are ``bytes``. Fields that are left out have their
defaults, as in ROS.
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
"""A message as plain values."""

_ENDIANNESS: Final = (b"\0\0", b"\0\1")
_HEADER: Final = 4
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
    """Writes and reads messages of the types of some definitions."""

    def __init__(self, definitions: Definitions) -> None:
        self._definitions = definitions
        self._store = definitions.store

    def encode(self, name: TypeName, message: Mapping[str, Any]) -> bytes:
        """Return a message as CDR, little endian, with its four-byte header.

        :raises Ros2Error: for a field that the type does not have, or a value that does not fit; it names the
            type and the field.
        """
        made = self._make(name, message, str(name))
        return bytes(self._store.serialize_cdr(made, str(name)))

    def decode(self, name: TypeName, data: bytes | memoryview) -> Message:
        """Return the message of CDR bytes. Bytes after its end are ignored: some RMWs send too many.

        :raises Ros2Error: when the bytes are no message of this type.
        """
        self._definitions.fields(name)
        try:
            made = self._read(name, data)
        except Exception:  # noqa: BLE001  generated code fails in many ways for bytes that are none
            raise Ros2Error(f"{len(data)} bytes are not a {name}") from None
        return self._plain(name, made)

    def _read(self, name: TypeName, data: bytes | memoryview) -> Any:
        """Read a message as rosbags does, which takes no more than three bytes after it."""
        if bytes(data[:2]) not in _ENDIANNESS:
            raise ValueError("no plain CDR")
        definition = self._store.get_msgdef(str(name))
        read = definition.deserialize_cdr_le if data[1] else definition.deserialize_cdr_be
        made, _end = read(data[_HEADER:], 0, definition.cls, self._store)
        return made

    # --- to ROS -------------------------------------------------------------------------------------------

    def _make(self, name: TypeName, message: object, path: str) -> Any:
        if not isinstance(message, Mapping):
            raise Ros2Error(f"{path}: a {name} is a mapping of fields, not {message!r}")
        fields = dict(self._definitions.fields(name))
        for key in message:
            if key not in fields or key == _PLACEHOLDER:
                hint = did_you_mean(str(key), [each for each in fields if each != _PLACEHOLDER], "")
                raise Ros2Error(f"{path}: {name} has no field '{key}'", hint=hint or None)
        given = {**self._definitions.defaults(name), **message}
        values = [
            self._value(kind, given[field], f"{path}.{field}") if field in given else self._zero(kind)
            for field, kind in fields.items()
        ]
        return self._store.types[str(name)](*values)

    def _value(self, kind: FieldType, given: Any, path: str) -> Any:
        node, rest = kind
        if node == Nodetype.NAME:
            return self._make(parse_type(rest), given, path)
        if node == Nodetype.BASE:
            return _base(rest, given, path)
        return self._list(node, rest[0], rest[1], given, path)

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

    def _plain(self, name: TypeName, made: Any) -> Message:
        return {
            field: self._unmade(kind, getattr(made, field if hasattr(made, field) else f"{field}_"))
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


def _base(kind: tuple[str, int], given: Any, path: str) -> Any:
    """Return a value as a field of a base type takes it."""
    name, bound = kind
    return _CHECKS[name](given, path, name, bound)


def _integer(given: Any, path: str, name: str, _bound: int) -> int:
    low, high = _INTEGERS[name]
    whole = int(given) if isinstance(given, float) and given.is_integer() else given
    if isinstance(whole, np.integer):
        whole = int(whole)
    if isinstance(whole, bool) or not isinstance(whole, int):
        raise Ros2Error(f"{path}: a whole number is wanted ({name}), not {given!r}")
    if not low <= whole <= high:
        raise Ros2Error(f"{path}: {whole} does not fit into {name} ({low} to {high})")
    return whole


def _byte(given: Any, path: str, name: str, bound: int) -> int:
    whole = _integer(given, path, name, bound)
    return whole - 256 if whole > 127 else whole  # noqa: PLR2004  rosbags writes a byte with a sign


def _float(given: Any, path: str, name: str, _bound: int) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float | np.number):
        raise Ros2Error(f"{path}: a number is wanted ({name}), not {given!r}")
    value = float(given)
    if name == "float32" and math.isfinite(value) and abs(value) > _FLOAT32_MAX:
        raise Ros2Error(f"{path}: {given} does not fit into float32")
    return value


def _boolean(given: Any, path: str, _name: str, _bound: int) -> bool:
    if not isinstance(given, bool | np.bool_):
        raise Ros2Error(f"{path}: true or false is wanted, not {given!r}")
    return bool(given)


def _string(given: Any, path: str, _name: str, bound: int) -> str:
    if not isinstance(given, str):
        raise Ros2Error(f"{path}: a string is wanted, not {given!r}")
    if "\0" in given:
        raise Ros2Error(f"{path}: a string has no NUL in it")
    try:
        size = len(given.encode())
    except UnicodeEncodeError:
        raise Ros2Error(f"{path}: {given!r} is no Unicode text") from None
    if bound and size > bound:
        raise Ros2Error(f"{path}: at most {bound} bytes are possible, not {size}")
    return given


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
