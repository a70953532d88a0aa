"""Conversion between messages and the JSON of a rosbridge."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np
from rosbags.interfaces import Nodetype

from cxbridge_ros2.definitions import Definitions, FieldType
from cxbridge_ros2.messages import BYTE_TYPES, EMPTY_MESSAGE_FIELD, Codec, Message
from cxbridge_ros2.names import TypeName, parse_type


class JsonCodec:
    """Converts messages to JSON and back."""

    def __init__(self, definitions: Definitions) -> None:
        self._definitions = definitions
        self._codec = Codec(definitions)

    def to_json(self, name: TypeName, message: Mapping[str, Any]) -> Any:
        """Return a message as JSON values, with bytes as Base64."""
        # through CDR, the one place that checks messages
        decoded = self._codec.decode(name, self._codec.encode(name, message))
        return msgspec.to_builtins(decoded, enc_hook=np.generic.item)

    def from_json(self, name: TypeName, value: Any) -> Message:
        """Return a message; missing and broken fields get their defaults."""
        fields = self._definitions.fields(name)
        members = value if isinstance(value, Mapping) else {}
        return {
            field: self._read_value(kind, members.get(field))
            for field, kind in fields
            if field != EMPTY_MESSAGE_FIELD
        }

    def _read_value(self, kind: FieldType, value: Any) -> Any:
        node, details = kind
        if node == Nodetype.NAME:
            return self.from_json(parse_type(details), value)
        if node == Nodetype.BASE:
            return base_value(details[0], value)
        element = details[0]
        element_node, element_details = element
        if element_node == Nodetype.BASE and element_details[0] in BYTE_TYPES:
            return _bytes(value)
        return [self._read_value(element, item) for item in value] if isinstance(value, list) else []


def base_value(kind: str, value: Any) -> Any:
    """Return a value for a base type; missing or mistyped values get the default."""
    if kind in ("float32", "float64"):
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return float(value) if is_number else math.nan  # the bridge sends NaN and infinities as null
    python_type: Any = {"bool": bool, "string": str}.get(kind, int)
    return value if isinstance(value, python_type) else python_type()


def _bytes(value: Any) -> bytes:
    """Return bytes from Base64, or from the list of numbers that other bridges send."""
    if isinstance(value, str):
        try:
            return base64.b64decode(value)
        except ValueError:
            return b""
    numbers = value if isinstance(value, list) else []
    return bytes(number & 0xFF for number in numbers if isinstance(number, int))
