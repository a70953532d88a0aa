"""Messages of any type, with random values."""

from __future__ import annotations

import math
from random import Random
from typing import Any

from rosbags.interfaces import Nodetype

from cxbridge_ros2.definitions import Definitions, FieldType
from cxbridge_ros2.messages import EMPTY_MESSAGE_FIELD, Codec
from cxbridge_ros2.names import TypeName, parse_type

_TEXTS = ("", "x", "a b", "é" * 40, "/", "\\", '"', "()", "$x", "%s{}", "move", "say", "victim", "robot1")
_NUMBERS = (0, 1, -1, 2, 3, 4, 5, 6, 7, 127, -128, 255, 2**31 - 1, -(2**31), 2**63 - 1)
_FLOATS = (0.0, -0.0, 1.0, -1e308, 1e308, float("nan"), float("inf"), float("-inf"))


class MessageGenerator:
    """Makes messages of any type with random values."""

    def __init__(self, types: Definitions, random: Random) -> None:
        self.random, self._types, self._codec = random, types, Codec(types)

    def make_message(self, name: TypeName) -> dict[str, Any]:
        fields = self._types.find_fields(name)
        return {
            field: self._value(field_type) for field, field_type in fields if field != EMPTY_MESSAGE_FIELD
        }

    def _value(self, field_type: FieldType) -> Any:
        node, rest = field_type
        if node == Nodetype.NAME:
            return self.make_message(parse_type(rest))
        if node == Nodetype.BASE:
            return self._base(*rest)
        of, count = rest
        size = count if node == Nodetype.ARRAY else self.random.randrange(min(count or 4, 4))
        if of[0] == Nodetype.BASE and of[1][0] in ("uint8", "byte"):
            return self.random.randbytes(size)
        return [self._value(of) for _ in range(size)]

    def _base(self, name: str, bound: int) -> Any:
        if name == "bool":
            return self.random.random() < 0.5
        if name == "string":
            return self.random.choice(_TEXTS)[: bound or None]
        if name.startswith("float"):
            value = self.random.choice(_FLOATS)
            return value if name == "float64" or math.isinf(value) or not abs(value) > 2 else 0.5
        bits = int(name.removeprefix("u").removeprefix("int")) if name != "byte" else 8
        low, high = (0, 2**bits - 1) if name[0] in "ub" else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        return self.random.choice([each for each in (*_NUMBERS, low, high) if low <= each <= high])

    def make_data(self, name: TypeName) -> bytes:
        """Return an encoded message, a damaged message, or random bytes."""
        data = self._codec.encode(name, self.make_message(name))
        choice = self.random.randrange(5)
        if choice == 0:
            return data[
                : self.random.randrange(5, len(data) + 1)
            ]  # the wheel of Cyclone DDS sends no empty data
        if choice == 1:
            position = self.random.randrange(4, max(5, len(data)))
            return data[:position] + self.random.randbytes(3) + data[position + 3 :]
        return b"\0\1\0\0" + self.random.randbytes(self.random.randrange(1, 80)) if choice == 2 else data
