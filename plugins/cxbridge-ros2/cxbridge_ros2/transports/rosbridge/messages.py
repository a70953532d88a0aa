"""Conversion between messages and the JSON of a rosbridge."""

from __future__ import annotations

import base64
import binascii
import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from rosbags.interfaces import Nodetype

from cxbridge_ros2.definitions import Definitions, FieldType
from cxbridge_ros2.messages import Codec, Message
from cxbridge_ros2.names import TypeName, parse_type

_BYTES: Final = ("uint8", "byte")
_NOTHING: Final = "structure_needs_at_least_one_member"


class JsonCodec:
    """Converts messages to JSON and back."""

    def __init__(self, definitions: Definitions) -> None:
        self._definitions = definitions
        self._codec = Codec(definitions)

    def to_json(self, name: TypeName, message: Mapping[str, Any]) -> Any:
        # through CDR, the one place that checks messages
        return _plain(self._codec.decode(name, self._codec.encode(name, message)))

    def from_json(self, name: TypeName, value: Any) -> Message:
        """Return a message; missing and broken fields get their defaults."""
        fields = self._definitions.fields(name)
        members = value if isinstance(value, Mapping) else {}
        return {field: self._value(kind, members.get(field)) for field, kind in fields if field != _NOTHING}

    def _value(self, kind: FieldType, value: Any) -> Any:
        node, rest = kind
        if node == Nodetype.NAME:
            return self.from_json(parse_type(rest), value)
        if node == Nodetype.BASE:
            return base_value(rest[0], value)
        of = rest[0]
        if of[0] == Nodetype.BASE and of[1][0] in _BYTES:
            return _bytes(value)
        return [self._value(of, each) for each in value] if isinstance(value, list) else []


def base_value(kind: str, value: Any) -> Any:
    """Return a value for a base type; missing or mistyped values get the default."""
    if kind in ("float32", "float64"):
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return float(value) if is_number else math.nan
    python_type: Any = {"bool": bool, "string": str}.get(kind, int)
    return value if isinstance(value, python_type) else python_type()


def _bytes(value: Any) -> bytes:
    if isinstance(value, str):
        try:
            return base64.b64decode(value)
        except (binascii.Error, ValueError):
            return b""
    numbers = value if isinstance(value, list) else []
    return bytes(each & 0xFF for each in numbers if isinstance(each, int))


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, list):
        return [_plain(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value
