"""Messages of any type, with values that are drawn."""

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


class Drawer:
    """Draws messages of any type."""

    def __init__(self, types: Definitions, random: Random) -> None:
        self.random, self._types, self._codec = random, types, Codec(types)

    def message(self, name: TypeName) -> dict[str, Any]:
        fields = self._types.find_fields(name)
        return {field: self._value(kind) for field, kind in fields if field != EMPTY_MESSAGE_FIELD}

    def _value(self, kind: FieldType) -> Any:
        node, rest = kind
        if node == Nodetype.NAME:
            return self.message(parse_type(rest))
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

    def data(self, name: TypeName) -> bytes:
        """Return a message, or bytes that were one, or never."""
        made = self._codec.encode(name, self.message(name))
        what = self.random.randrange(5)
        if what == 0:
            return made[: self.random.randrange(5, len(made) + 1)]  # the wheel sends no empty ones
        if what == 1:
            place = self.random.randrange(4, max(5, len(made)))
            return made[:place] + self.random.randbytes(3) + made[place + 3 :]
        return b"\0\1\0\0" + self.random.randbytes(self.random.randrange(1, 80)) if what == 2 else made
