"""Conversion between messages and the JSON of the rosbridge protocol."""

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

    def to_json(self, type_name: TypeName, message: Mapping[str, Any]) -> Any:
        """Return a message as JSON values, with bytes as Base64."""
        # converted to CDR and back, since `Codec` checks messages
        checked_message = self._codec.decode(type_name, self._codec.encode(type_name, message))
        # the hook converts scalars of NumPy to scalars of Python
        return msgspec.to_builtins(checked_message, enc_hook=np.generic.item)

    def from_json(self, type_name: TypeName, value: Any) -> Message:
        """Return the message in JSON values. A missing or invalid field becomes zero or empty."""
        fields = self._definitions.find_fields(type_name)
        members = value if isinstance(value, Mapping) else {}
        return {
            field: self._read_value(field_type, members.get(field))
            for field, field_type in fields
            if field != EMPTY_MESSAGE_FIELD
        }

    def _read_value(self, field_type: FieldType, value: Any) -> Any:
        match field_type:
            case (Nodetype.NAME, message_name):
                return self.from_json(parse_type(message_name), value)
            case (Nodetype.BASE, (base_type, _)):
                return to_base_type(base_type, value)
            case (_, ((Nodetype.BASE, (base_type, _)), _)) if base_type in BYTE_TYPES:
                return _decode_bytes(value)
        _, (element_type, _size) = field_type
        return [self._read_value(element_type, item) for item in value] if isinstance(value, list) else []


def to_base_type(field_type: str, value: Any) -> Any:
    """Return a JSON value as a base type. A missing or mistyped value becomes zero or empty."""
    if field_type in ("float32", "float64"):
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return float(value) if is_number else math.nan  # the bridge sends NaN and infinities as null
    python_type: Any = {"bool": bool, "string": str}.get(field_type, int)
    return value if isinstance(value, python_type) else python_type()


def _decode_bytes(value: Any) -> bytes:
    """Return the bytes in Base64. A missing or mistyped value becomes empty."""
    try:
        return base64.b64decode(value if isinstance(value, str) else "")
    except ValueError:
        return b""
