"""Assignments ``NAME=VALUE`` to fields of interfaces and messages, and values of fields as text."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Mapping
from enum import IntEnum
from typing import Any

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.accessors import misfit_error
from cxbridge.interfaces.block import Block
from cxbridge.interfaces.schema import FieldSchema

_ASSIGNMENT = re.compile(r"([A-Za-z_]\w*)=(.*)", re.DOTALL)
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
    """Set fields by ``NAME=VALUE``, or ``NAME=V,V,V`` for arrays.

    Enum values are names or numbers. Empty elements of an array are left out, so that ``NAME=`` is an empty
    array; the elements after the last become zero.

    :returns: whether a value changed.
    :raises InterfaceError: if an assignment is invalid; the previous assignments keep their effect.
    """
    previous_bytes = block.to_bytes()
    for assignment in assignments:
        match = _ASSIGNMENT.fullmatch(assignment)
        if match is None:
            raise InterfaceError(f"'{assignment}' is not an assignment", hint="write NAME=VALUE")
        field = block.field(match[1])
        value: Any
        if field.is_array:
            element_texts = [text for text in match[2].split(",") if text.strip()]
            value = [_parse_element(block, field, text) for text in element_texts]
        else:
            value = _parse_element(block, field, match[2])
        set_field(block, field.name, value)
    return block.to_bytes() != previous_bytes


def _parse_element(block: Block, field: FieldSchema, text: str) -> bool | int | float | str:
    """Return the value of a field, or of an element of an array, from its text.

    :raises InterfaceError: if the field cannot hold the value.
    """
    word = text.strip()
    try:
        if field.is_string:
            return text
        if field.storage.python_type is bool:
            return _BOOL_LITERALS[word.lower()]
        if field.storage.python_type is float:
            return float(word)
        if field.enum is not None and any(item.name == word for item in field.enum.items):
            return word
        return int(word)
    except (KeyError, ValueError):
        raise misfit_error(block.SCHEMA.name, field, word) from None


def set_field(block: Block, name: str, value: Any) -> None:
    """Set a field to the value of a user, checked more strictly than in Fawkes.

    :meth:`Block.set <cxbridge.interfaces.block.Block.set>` cuts a long text, or a text
    at a NUL, and accepts a number without an enum item; this function refuses all three.

    :raises InterfaceError: if there is no such field, or the value does not fit.
    """
    field = block.field(name)
    if field.is_string and isinstance(value, str):
        # a surrogate counts as the byte for which it stands; `set` refuses surrogates that stand for no byte
        if len(value.encode(errors="replace")) > field.text_room or "\0" in value:
            raise InterfaceError(
                f"the text for {block.SCHEMA.name}.{name} does not fit: '{value}'",
                hint=f"{name} holds {field.text_room} bytes of UTF-8 without NUL",
            )
    elif field.enum is not None:
        numbers = {item.value for item in field.enum.items}
        for element in value if field.is_array and isinstance(value, list | tuple) else (value,):
            # `set` checks elements of other types: truth values, and items of IntEnum classes
            if type(element) is int and element not in numbers:
                raise misfit_error(block.SCHEMA.name, field, element)
    block.set(name, value)


def json_value(value: Any) -> Any:
    """Return a field's value for JSON, with enum values by name."""
    if isinstance(value, tuple):
        return [json_value(element) for element in value]
    return value.name if isinstance(value, IntEnum) else value


def field_text(value: Any) -> str:
    """Return a field's value as text, with texts in quotes."""
    if isinstance(value, tuple):
        return ",".join(field_text(element) for element in value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(json_value(value))


def fields_text(values: Mapping[str, Any], names: Collection[str] | None = None) -> str:
    """Return fields as ``name=value name=value``, in the order of ``values``.

    :param values: the values by field name.
    :param names: the fields to include; None includes all.
    """
    chosen_names = values if names is None else [name for name in values if name in names]
    return " ".join(f"{name}={field_text(values[name])}" for name in chosen_names)
