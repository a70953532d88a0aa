"""``NAME=VALUE`` as it is typed on a command line, to fields of interfaces and messages; values to text."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import Any

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.block import Block
from cxbridge.interfaces.schema import FieldSchema

_ASSIGNMENT = re.compile(r"(?P<name>[A-Za-z_]\w*)(?:\[(?P<index>\d+)\])?=(?P<value>.*)", re.DOTALL)
_BOOLS = {
    "true": True,
    "yes": True,
    "on": True,
    "1": True,
    "false": False,
    "no": False,
    "off": False,
    "0": False,
}


def assign(block: Block, assignments: Iterable[str]) -> bool:
    """Set fields: ``NAME=VALUE``, ``NAME=V,V,V`` or ``NAME[INDEX]=VALUE``.

    Numbers may be hexadecimal, enum values are given by name or number, a text is taken as it is.

    :returns: whether a value became another one.
    :raises InterfaceError: when one makes no sense; then those before it are set.
    """
    before = block.to_bytes()
    for text in assignments:
        match = _ASSIGNMENT.fullmatch(text)
        if match is None:
            raise InterfaceError(f"'{text}' sets no field", hint="write NAME=VALUE or NAME[INDEX]=VALUE")
        field = block.field(match["name"])
        if match["index"] is not None:
            if not field.is_array:
                raise InterfaceError(
                    f"{field.name} is a single value and has no index", hint="write NAME=VALUE"
                )
            block.set(field.name, _element(field, match["value"]), int(match["index"]))
        elif field.is_array:
            elements = match["value"].strip().removeprefix("[").removesuffix("]").split(",")
            values = [_element(field, element) for element in elements if element.strip()]
            block.set(field.name, values)
        else:
            block.set(field.name, _element(field, match["value"]))
    return block.to_bytes() != before


def _element(field: FieldSchema, text: str) -> bool | int | float | str:
    """Return one value of a field."""
    if field.is_string:
        return text
    stripped = text.strip()
    try:
        if field.type == "bool":
            return _BOOLS[stripped.lower()]
        if field.type in ("float", "double"):
            return float(stripped)
        if field.enum is not None and any(item.name == stripped for item in field.enum.items):
            return stripped
        return int(stripped, 0)
    except (KeyError, ValueError):
        wanted = field.storage.fits
        if field.enum is not None:
            wanted = "one of " + ", ".join(item.name for item in field.enum.items)
        raise InterfaceError(
            f"'{stripped}' is not a value for {field.name} of type {field.type}", hint=f"it holds {wanted}"
        ) from None


def plain(value: Any) -> Any:
    """Return a field's value as JSON can have it: enum values by name."""
    if isinstance(value, tuple):
        return [plain(element) for element in value]
    return value.name if isinstance(value, IntEnum) else value


def shown(value: Any) -> str:
    """Return a field's value as :func:`assign` would read it; texts in quotes."""
    if isinstance(value, tuple):
        return ",".join(shown(element) for element in value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(plain(value))


def shown_fields(values: Mapping[str, Any], names: Iterable[str] | None = None) -> str:
    """Return fields as ``name=value name=value``; those that are named, or all."""
    chosen = values if names is None else [name for name in values if name in set(names)]
    return " ".join(f"{name}={shown(values[name])}" for name in chosen)
