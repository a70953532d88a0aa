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

    def from_json(self, type_name: TypeName, json_value: Any) -> Message:
        """Return the message in a JSON object. A missing or invalid field becomes NaN, zero or empty."""
        fields = self._definitions.find_fields(type_name)
        members = json_value if isinstance(json_value, Mapping) else {}
        return {
            field: self._read_value(field_type, members.get(field))
            for field, field_type in fields
            if field != EMPTY_MESSAGE_FIELD
        }

    def _read_value(self, field_type: FieldType, json_value: Any) -> Any:
        match field_type:
            case (Nodetype.NAME, message_name):
                return self.from_json(parse_type(message_name), json_value)
            case (Nodetype.BASE, (base_type, _)):
                return to_base_type(base_type, json_value)
            # an array or sequence of bytes
            case (_, ((Nodetype.BASE, (base_type, _)), _)) if base_type in BYTE_TYPES:
                return _decode_bytes(json_value)
        _, (element_type, _size) = field_type  # another array or sequence
        return (
            [self._read_value(element_type, element) for element in json_value]
            if isinstance(json_value, list)
            else []
        )


def to_base_type(base_type: str, json_value: Any) -> Any:
    """Return a JSON value as a base type of ROS.

    A missing or mistyped value becomes NaN for a float type, otherwise zero, false or an empty string.
    """
    if base_type in ("float32", "float64"):
        is_number = isinstance(json_value, int | float) and not isinstance(json_value, bool)
        return float(json_value) if is_number else math.nan  # the bridge sends NaN and infinities as null
    python_type: Any = {"bool": bool, "string": str}.get(base_type, int)
    return json_value if type(json_value) is python_type else python_type()  # a bool is no int in JSON


def _decode_bytes(json_value: Any) -> bytes:
    """Return the bytes in a Base64 text. A missing value, or a text without a decoding, becomes empty."""
    try:
        return base64.b64decode(json_value if isinstance(json_value, str) else "")
    except ValueError:
        return b""
