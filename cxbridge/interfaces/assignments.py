"""``NAME=VALUE`` as it is typed on a command line, to fields of interfaces and messages; values to text."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from enum import IntEnum
from typing import Any

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.block import Block
from cxbridge.interfaces.schema import EnumItem, EnumSchema, FieldSchema

_ASSIGNMENT = re.compile(r"(?P<name>[A-Za-z_]\w*)(?:\[(?P<index>\d+)\])?=(?P<value>.*)", re.DOTALL)
_QUOTED = re.compile(r'".*"', re.DOTALL)
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

    Numbers may be hexadecimal, enum values are given by name or number. A text is taken as it is, but one in
    double quotes is read as JSON: what :func:`shown` returns reads back.

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
    stripped = text.strip()
    try:
        if field.is_string:
            return _text(field, text)
        if field.type == "bool":
            return _BOOLS[stripped.lower()]
        if field.type in ("float", "double"):
            return float(stripped)
        if field.enum is not None:
            return _enum_item(field.enum, stripped).value
        return _whole_number(stripped)
    except (KeyError, ValueError):
        wanted = field.storage.fits
        if field.enum is not None:
            wanted = "one of " + ", ".join(item.name for item in field.enum.items)
        raise InterfaceError(
            f"'{stripped}' is not a value for {field.name} of type {field.type}", hint=f"it holds {wanted}"
        ) from None


def _whole_number(text: str) -> int:
    """Return a decimal number, which may begin with zeros, or one with the prefix 0x, 0o or 0b."""
    try:
        return int(text)
    except ValueError:
        return int(text, 0)


def _enum_item(enum: EnumSchema, text: str) -> EnumItem:
    """Return the item of an enum by its name or number.

    :raises ValueError: when the enum has no such item.
    """
    for item in enum.items:
        if item.name == text:
            return item
    number = _whole_number(text)
    for item in enum.items:
        if item.value == number:
            return item
    raise ValueError(text)


def _text(field: FieldSchema, text: str) -> str:
    """Return the text of a field, without the quotes that :func:`shown` writes.

    :raises InterfaceError: when it is too long for the field, or has a NUL, which would end it.
    :raises ValueError: when it is not Unicode.
    """
    if _QUOTED.fullmatch(text):
        with suppress(ValueError):
            text = json.loads(text, strict=False)
    size = len(text.encode("utf-8", "surrogateescape"))
    if size > field.text_room:
        raise InterfaceError(
            f"this text for {field.name} has {size} bytes: '{text}'",
            hint=f"{field.name} holds {field.text_room} bytes of UTF-8",
        )
    if "\0" in text:
        raise InterfaceError(f"the text for {field.name} has a NUL", hint="a NUL ends a text: leave it out")
    return text


def plain(value: Any) -> Any:
    """Return a field's value as JSON can have it: enum values by name."""
    if isinstance(value, tuple):
        return [plain(element) for element in value]
    return value.name if isinstance(value, IntEnum) else value


def shown(value: Any) -> str:
    """Return a field's value as :func:`assign` reads it; texts in quotes, as JSON."""
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
