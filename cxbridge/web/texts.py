"""JSON of replies."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any


def to_json(value: Any, *, pretty: bool = False) -> bytes:
    """Return a value as JSON; numbers that JSON has not are null, bytes that are no UTF-8 a question mark."""
    try:
        text = _dump(value, pretty=pretty)
    except ValueError:
        text = _dump(_finite(value), pretty=pretty)
    return text.encode("utf-8", "replace")


def _dump(value: Any, *, pretty: bool) -> str:
    if pretty:
        return json.dumps(value, ensure_ascii=False, allow_nan=False, indent=4, default=_plain)
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"), default=_plain)


def _plain(value: object) -> Any:
    """Return a value of an interface that JSON does not know in a form that it knows."""
    if isinstance(value, bytes | bytearray | memoryview):
        return value.hex()
    if isinstance(value, Mapping):
        return dict(value)
    return str(value)


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {name: _finite(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return value
