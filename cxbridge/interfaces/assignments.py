"""Assignments ``NAME=VALUE`` to fields of interfaces and messages, and values of fields as text."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from enum import IntEnum
from typing import Any

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.block import Block
from cxbridge.interfaces.schema import FieldSchema

_ASSIGNMENT = re.compile(r"(?P<name>[A-Za-z_]\w*)(?:\[(?P<index>\d{1,9})\])?=(?P<value>.*)", re.DOTALL)
_QUOTED = re.compile(r'".*"', re.DOTALL)
_BOOL_LITERALS = {
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
    """Set fields by ``NAME=VALUE``, ``NAME=V,V,V`` or ``NAME[INDEX]=VALUE``.

    Numbers may be hexadecimal; enum values are names or numbers. A text in double quotes is parsed as JSON,
    so that the results of :func:`field_text` can be read back.

    :returns: whether a value changed.
    :raises InterfaceError: if an assignment is invalid; the previous assignments keep their effect.
    """
    previous = block.to_bytes()
    for text in assignments:
        match = _ASSIGNMENT.fullmatch(text)
        if match is None:
            raise InterfaceError(
                f"'{text}' is not an assignment", hint="write NAME=VALUE or NAME[INDEX]=VALUE"
            )
        field = block.field(match["name"])
        if match["index"] is not None:
            if not field.is_array:
                raise InterfaceError(
                    f"{field.name} is a single value and has no index", hint="write NAME=VALUE"
                )
            set_field(block, field.name, _parse_element(field, match["value"]), int(match["index"]))
        elif field.is_array:
            elements = match["value"].strip().removeprefix("[").removesuffix("]").split(",")
            values = [_parse_element(field, element) for element in elements if element.strip()]
            set_field(block, field.name, values)
        else:
            set_field(block, field.name, _parse_element(field, match["value"]))
    return block.to_bytes() != previous


def _parse_element(field: FieldSchema, text: str) -> bool | int | float | str:
    stripped = text.strip()
    try:
        if field.is_string:
            return _remove_quotes(text)
        if field.type == "bool":
            return _BOOL_LITERALS[stripped.lower()]
        if field.type in ("float", "double"):
            return float(stripped)
        if field.enum is not None and any(item.name == stripped for item in field.enum.items):
            return stripped
        return _parse_integer(stripped)
    except (KeyError, ValueError):
        raise _make_misfit_error(field, stripped) from None


def _parse_integer(text: str) -> int:
    """Parse an integer."""
    # base 0 accepts 0x10, but refuses the leading zeros of 007
    try:
        return int(text)
    except ValueError:
        return int(text, 0)


def _remove_quotes(text: str) -> str:
    """Remove the quotes that :func:`field_text` adds."""
    if _QUOTED.fullmatch(text):
        with suppress(ValueError):  # a text in quotes that is not JSON keeps its quotes
            text = json.loads(text, strict=False)
    return text


def set_field(block: Block, name: str, value: Any, index: int | None = None) -> None:
    """Set a field to the value of a user, checked more strictly than in Fawkes.

    :meth:`Block.set <cxbridge.interfaces.block.Block.set>` cuts a long text, and accepts a number without an
    enum item; this function refuses both.

    :raises InterfaceError: if the value does not fit.
    """
    field = block.field(name)
    elements = value if field.is_array and isinstance(value, list | tuple) else (value,)
    for element in elements:
        if field.is_string and isinstance(element, str):
            _check_text(field, element)
        items = () if field.enum is None else field.enum.items
        if items and type(element) is int and element not in {item.value for item in items}:
            raise _make_misfit_error(field, str(element))
    block.set(name, value, index)


def _check_text(field: FieldSchema, text: str) -> None:
    try:
        size = len(text.encode("utf-8", "surrogateescape"))
    except UnicodeEncodeError:
        return  # `Block.set` raises the error
    if size > field.text_room:
        raise InterfaceError(
            f"the text for {field.name} has {size} bytes: '{text}'",
            hint=f"{field.name} holds {field.text_room} bytes of UTF-8",
        )
    if "\0" in text:
        raise InterfaceError(f"the text for {field.name} contains a NUL", hint="omit it: a NUL ends the text")


def _make_misfit_error(field: FieldSchema, text: str) -> InterfaceError:
    allowed = field.storage.allowed_values
    if field.enum is not None:
        allowed = "one of " + ", ".join(item.name for item in field.enum.items)
    return InterfaceError(
        f"'{text}' is not a value for {field.name} of type {field.type}", hint=f"it holds {allowed}"
    )


def json_value(value: Any) -> Any:
    """Return a field's value for JSON, with enum values by name."""
    if isinstance(value, tuple):
        return [json_value(element) for element in value]
    return value.name if isinstance(value, IntEnum) else value


def field_text(value: Any) -> str:
    """Return a field's value in the form that :func:`assign` reads."""
    if isinstance(value, tuple):
        return ",".join(field_text(element) for element in value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(json_value(value))


def fields_text(values: Mapping[str, Any], names: Iterable[str] | None = None) -> str:
    """Return fields as ``name=value name=value``.

    :param names: the fields to include; None includes all.
    """
    chosen_names = values if names is None else [name for name in values if name in set(names)]
    return " ".join(f"{name}={field_text(values[name])}" for name in chosen_names)
