"""Source of Python modules and typed stubs for interface types.

A module needs no XML at run time: the module has the schema as JSON, and makes the classes of the schema. The
stub next to it declares the classes for editors and type checkers.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

from cxbridge.interfaces.classes import attribute_name, enum_member_name
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.schema import (
    EnumSchema,
    FieldSchema,
    InterfaceSchema,
    MessageSchema,
    schema_to_json,
)

_WIDTH = 88  # columns of docstrings, as in ruff's default
_GENERATOR_NOTE = "Made by 'cxbridge interface compile': do not edit, generate it again."
_INDENT = "    "
_MODULE_TEMPLATE = '''\
"""The interface type {name}.

{note}
"""

from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.schema import schema_from_json

_DEFINITION = r"""
{definition}
"""

{name} = make_interface_class(schema_from_json(_DEFINITION))
'''
_ZERO_LITERALS = {"bool": "False", "str": '""', "float": "0.0", "int": "0"}
# The names of a definition, messages with many fields, and bool fields may break these rules of ruff. The
# docstrings of stubs, which PYI021 forbids, are for editors. TC001 and TC003 are about imports at run time,
# which stubs do not have. RUF100 reports the rules that a stub does not break.
_NOQA = "# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003"


def module_source(schema: InterfaceSchema) -> str:
    """Return the source of a module with the class of an interface."""
    # JSON escapes quotes: no text of the definition can end the literal
    return _MODULE_TEMPLATE.format(name=schema.name, note=_GENERATOR_NOTE, definition=schema_to_json(schema))


def stub_source(schema: InterfaceSchema) -> str:
    """Return the source of a stub (``.pyi``) with the class of an interface."""
    return "\n".join(_StubWriter(schema).lines()) + "\n"


class _StubWriter:
    """Makes the lines of the stub of an interface type."""

    def __init__(self, schema: InterfaceSchema) -> None:
        self._schema = schema

    def lines(self) -> Iterator[str]:
        yield from self._header_lines()
        yield from self._class_lines()

    def _header_lines(self) -> Iterator[str]:
        """Yield the lines before the class."""
        schema = self._schema
        yield from _summary_docstring_lines(f"The interface type {schema.name}.", _GENERATOR_NOTE, "")
        yield ""
        yield _NOQA
        yield ""
        standard_imports = list(self._standard_imports())
        if standard_imports:
            yield from [*standard_imports, ""]
        if self._uses_arrays():
            yield "from cxbridge.interfaces.accessors import Array"
        bases = "Interface, Message" if schema.messages else "Interface"
        yield f"from cxbridge.interfaces.instance import {bases}"
        yield ""

    def _standard_imports(self) -> Iterator[str]:
        if self._uses_arrays(in_messages=True):
            yield "from collections.abc import Sequence"
        if self._schema.enums:
            yield "from enum import IntEnum"
        if self._schema.enums or self._schema.constants:
            yield "from typing import ClassVar"

    def _uses_arrays(self, *, in_messages: bool = False) -> bool:
        """Return whether the interface or its messages have array fields.

        :param in_messages: whether to look only at messages.
        """
        fields_of_blocks = [message.fields for message in self._schema.messages]
        if not in_messages:
            fields_of_blocks.append(self._schema.fields)
        return any(field.is_array for fields in fields_of_blocks for field in fields)

    def _class_lines(self) -> Iterator[str]:
        schema = self._schema
        yield f"class {schema.name}(Interface):"
        yield from _summary_docstring_lines(f"The interface type {schema.name}.", schema.comment, _INDENT)
        for enum in schema.enums:
            yield from self._enum_lines(enum)
        yield from self._constant_lines()
        for message in schema.messages:
            yield from self._message_lines(message)
        yield from self._annotation_lines(schema.fields, Interface, _INDENT, "")

    def _enum_lines(self, enum: EnumSchema) -> Iterator[str]:
        """Yield an enum class, and its items as members of the interface."""
        inner_indent, name = _INDENT * 2, attribute_name(enum.name, Interface)
        yield ""
        yield f"{_INDENT}class {name}(IntEnum):"
        yield from _summary_docstring_lines(f"Values of type {enum.name}.", enum.comment, inner_indent)
        for item in enum.items:
            yield ""
            yield f"{inner_indent}{enum_member_name(item.name)} = {item.value}"
            yield from _docstring_lines(item.comment, inner_indent)
        yield ""
        for item in enum.items:
            # C++ has the items in the scope of the interface
            yield f"{_INDENT}{attribute_name(item.name, Interface)}: ClassVar[{name}]"

    def _constant_lines(self) -> Iterator[str]:
        for constant in self._schema.constants:
            type_name = type(constant.value).__name__
            yield ""
            yield f"{_INDENT}{attribute_name(constant.name, Interface)}: ClassVar[{type_name}]"
            yield from _docstring_lines(constant.comment, _INDENT)

    def _message_lines(self, message: MessageSchema) -> Iterator[str]:
        inner_indent = _INDENT * 2
        yield ""
        yield f"{_INDENT}class {message.name}(Message):"
        yield from _summary_docstring_lines(f"The message {message.name}.", message.comment, inner_indent)
        yield from self._annotation_lines(message.fields, Message, inner_indent, f"{self._schema.name}.")
        if message.fields:
            yield from self._constructor_lines(message, inner_indent)

    def _constructor_lines(self, message: MessageSchema, indent: str) -> Iterator[str]:
        """Yield the constructor of a message, which takes fields by position or keyword."""
        body_indent = indent + _INDENT
        names = [attribute_name(field.name, Message) for field in message.fields]
        yield ""
        yield f"{indent}def __init__("
        yield f"{body_indent}self,"
        for name, field in zip(names, message.fields, strict=True):
            type_name = _python_type_name(field, f"{self._schema.name}.")
            if field.is_array:
                yield f"{body_indent}{name}: Sequence[{type_name}] = (),"
            elif field.is_enum:
                yield f"{body_indent}{name}: {type_name} | int = 0,"
            else:
                yield f"{body_indent}{name}: {type_name} = {_ZERO_LITERALS[type_name]},"
        yield f"{indent}) -> None: ..."

    def _annotation_lines(
        self, fields: tuple[FieldSchema, ...], base: type, indent: str, enum_prefix: str
    ) -> Iterator[str]:
        """Yield the annotations of fields.

        :param base: the base class, whose attributes no field can have.
        :param enum_prefix: the qualifier of the interface's enums, empty within the interface's class.
        """
        for field in fields:
            type_name = _python_type_name(field, enum_prefix)
            yield ""
            name = attribute_name(field.name, base)
            yield f"{indent}{name}: {f'Array[{type_name}]' if field.is_array else type_name}"
            yield from _docstring_lines(field.comment, indent)


def _python_type_name(field: FieldSchema, enum_prefix: str) -> str:
    if field.is_enum:
        return enum_prefix + attribute_name(field.type, Interface)
    return field.storage.python_type.__name__


def _summary_docstring_lines(summary: str, comment: str, indent: str) -> Iterator[str]:
    """Yield the docstring of a module or class: a summary, and the comment unless it is empty."""
    lines = _wrap(comment, indent)
    yield from _quote_lines([summary, "", *lines] if lines else [summary], indent)


def _docstring_lines(text: str, indent: str) -> Iterator[str]:
    """Yield a docstring, on one line if it fits; nothing for an empty text."""
    return _quote_lines(_wrap(text, indent + '"""'), indent)


def _quote_lines(lines: Sequence[str], indent: str) -> Iterator[str]:
    if len(lines) == 1 and len(indent) + len(lines[0]) + 2 * len('"""') <= _WIDTH:
        yield f'{indent}"""{lines[0]}"""'
    elif lines:
        yield f'{indent}"""{lines[0]}'
        yield from (f"{indent}{line}" if line else "" for line in lines[1:])
        yield f'{indent}"""'


def _wrap(text: str, indent: str) -> list[str]:
    """Wrap a text for a docstring; backslashes and double quotes, which could end it, are replaced."""
    # the docstring is for readers, the schema has the exact text
    text = text.replace("\\", "/").replace('"', "'")
    return textwrap.wrap(text, _WIDTH - len(indent), break_on_hyphens=False)
