"""Source of typed Python modules and stubs for interface types.

A module needs no XML at run time: the module has the schema as JSON, and classes with typed attributes, to
which :func:`cxbridge.interfaces.classes.define` adds the properties. A stub has the declarations alone.
"""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator

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
_PYTHON_TYPES = {"bool": "bool", "string": "str", "float": "float", "double": "float"}
_ZEROS = {"bool": "False", "str": '""', "float": "0.0"}
# The names of a definition, messages with many fields, and bool fields may break these rules of ruff. The
# docstrings of stubs, which PYI021 forbids, are for editors.
_NOQA = "# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003"


def module_source(schema: InterfaceSchema) -> str:
    """Return the source of a module with the class of an interface."""
    return _SourceWriter(schema, is_stub=False).write_source()


def stub_source(schema: InterfaceSchema) -> str:
    """Return the source of a stub (``.pyi``) with the class of an interface."""
    return _SourceWriter(schema, is_stub=True).write_source()


class _SourceWriter:
    """Writes one module or stub."""

    def __init__(self, schema: InterfaceSchema, *, is_stub: bool) -> None:
        self._schema = schema
        self._is_stub = is_stub

    def write_source(self) -> str:
        return "\n".join([*self._header_lines(), *self._class_lines()]) + "\n"

    def _header_lines(self) -> Iterator[str]:
        """Yield the lines before the class."""
        schema = self._schema
        yield from _class_docstring_lines(f"The interface type {schema.name}.", _GENERATOR_NOTE, "")
        yield ""
        yield _NOQA
        yield ""
        if not self._is_stub:
            yield "from __future__ import annotations"
            yield ""
        standard_imports = list(self._standard_imports())
        if standard_imports:
            yield from [*standard_imports, ""]
        if self._uses_arrays():
            yield "from cxbridge.interfaces.accessors import Array"
        if not self._is_stub:
            names = ["define", "enum_value_name"] if schema.enums else ["define"]
            yield f"from cxbridge.interfaces.classes import {', '.join(names)}"
        bases = "Interface, Message" if schema.messages else "Interface"
        yield f"from cxbridge.interfaces.instance import {bases}"
        if schema.pseudomaps:
            yield "from cxbridge.interfaces.pseudomap import PseudoMap"
        if not self._is_stub:
            yield "from cxbridge.interfaces.schema import schema_from_json"
            yield ""
            # JSON escapes quotes: no text of the definition can end this literal
            yield '_DEFINITION = r"""'
            yield schema_to_json(schema)
            yield '"""'
            yield ""
            yield "SCHEMA = schema_from_json(_DEFINITION)"
            yield ""
        yield ""

    def _standard_imports(self) -> Iterator[str]:
        if self._uses_arrays(in_messages=True):
            yield "from collections.abc import Sequence"
        if self._schema.enums:
            yield "from enum import IntEnum"
        if self._schema.enums or self._schema.constants:
            yield "from typing import ClassVar"

    def _uses_arrays(self, *, in_messages: bool = False) -> bool:
        """Return whether there are array fields."""
        blocks = [message.fields for message in self._schema.messages]
        if not in_messages:
            blocks.append(self._schema.fields)
        return any(field.is_array for fields in blocks for field in fields)

    def _class_lines(self) -> Iterator[str]:
        schema = self._schema
        if not self._is_stub:
            yield "@define(SCHEMA)"
        yield f"class {schema.name}(Interface):"
        yield from _class_docstring_lines(f"The interface type {schema.name}.", schema.comment, _INDENT)
        if not self._is_stub:
            yield ""
            yield f"{_INDENT}__slots__ = ()"
        for enum in schema.enums:
            yield from self._enum_lines(enum)
        yield from self._constant_lines()
        for message in schema.messages:
            yield from self._message_lines(message)
        yield from self._annotation_lines(schema.fields, Interface, _INDENT, "")
        for pseudomap in schema.pseudomaps:
            yield ""
            yield f"{_INDENT}{attribute_name(pseudomap.name, Interface)}: PseudoMap"
            yield from _docstring_lines(pseudomap.comment, _INDENT)

    def _enum_lines(self, enum: EnumSchema) -> Iterator[str]:
        """Yield an enum class, its items as members of the interface, and tostring_ENUM."""
        inner_indent, name = _INDENT * 2, attribute_name(enum.name, Interface)
        yield ""
        yield f"{_INDENT}class {name}(IntEnum):"
        yield from _class_docstring_lines(f"Values of type {enum.name}.", enum.comment, inner_indent)
        for item in enum.items:
            yield ""
            yield f"{inner_indent}{enum_member_name(item.name)} = {item.value}"
            yield from _docstring_lines(item.comment, inner_indent)
        yield ""
        for item in enum.items:
            member, value = attribute_name(item.name, Interface), f"{name}.{enum_member_name(item.name)}"
            # C++ has the items in the scope of the interface
            yield f"{_INDENT}{member}: ClassVar[{name}]" + ("" if self._is_stub else f" = {value}")
        yield ""
        yield f"{_INDENT}@staticmethod"
        signature = f"{_INDENT}def tostring_{enum.name}(value: int) -> str:"
        if self._is_stub:
            yield f"{signature} ..."
            return
        yield signature
        yield from _docstring_lines("Return the name of a value, UNKNOWN if it has none.", inner_indent)
        yield f"{inner_indent}return enum_value_name({self._schema.name}.{name}, value)"

    def _constant_lines(self) -> Iterator[str]:
        for constant in self._schema.constants:
            python_type = type(constant.value).__name__
            yield ""
            value = "" if self._is_stub else f" = {_format_literal(constant.value)}"
            yield f"{_INDENT}{attribute_name(constant.name, Interface)}: ClassVar[{python_type}]{value}"
            yield from _docstring_lines(constant.comment, _INDENT)

    def _message_lines(self, message: MessageSchema) -> Iterator[str]:
        inner_indent = _INDENT * 2
        yield ""
        yield f"{_INDENT}class {message.name}(Message):"
        yield from _class_docstring_lines(f"The message {message.name}.", message.comment, inner_indent)
        if not self._is_stub:
            yield ""
            yield f"{inner_indent}__slots__ = ()"
        yield from self._annotation_lines(message.fields, Message, inner_indent, f"{self._schema.name}.")
        if message.fields:
            yield from self._constructor_lines(message, inner_indent)

    def _constructor_lines(self, message: MessageSchema, indent: str) -> Iterator[str]:
        """Yield the constructor of a message, which takes fields by position or keyword."""
        body = indent + _INDENT
        names = [attribute_name(field.name, Message) for field in message.fields]
        yield ""
        yield f"{indent}def __init__("
        yield f"{body}self,"
        for name, field in zip(names, message.fields, strict=True):
            python_type = _find_python_type(field, f"{self._schema.name}.")
            if field.is_array:
                yield f"{body}{name}: Sequence[{python_type}] = (),"
            elif field.is_enum:
                yield f"{body}{name}: {python_type} | int = 0,"
            else:
                yield f"{body}{name}: {python_type} = {_ZEROS.get(python_type, '0')},"
        if self._is_stub:
            yield f"{indent}) -> None: ..."
            return
        yield f"{indent}) -> None:"
        yield from _docstring_lines("Make a message; omitted values are zero.", body)
        yield f"{body}super().__init__({', '.join(names)})"

    def _annotation_lines(
        self, fields: tuple[FieldSchema, ...], base: type, indent: str, enum_prefix: str
    ) -> Iterator[str]:
        for field in fields:
            python_type = _find_python_type(field, enum_prefix)
            yield ""
            name = attribute_name(field.name, base)
            yield f"{indent}{name}: {f'Array[{python_type}]' if field.is_array else python_type}"
            yield from _docstring_lines(field.comment, indent)


def _find_python_type(field: FieldSchema, enum_prefix: str) -> str:
    if field.is_enum:
        return enum_prefix + attribute_name(field.type, Interface)
    return _PYTHON_TYPES.get(field.type, "int")


def _class_docstring_lines(summary: str, comment: str, indent: str) -> Iterator[str]:
    if not comment:
        yield f'{indent}"""{summary}"""'
        return
    yield f'{indent}"""{summary}'
    yield ""
    yield from (f"{indent}{line}" for line in _wrap(comment, indent))
    yield f'{indent}"""'


def _docstring_lines(text: str, indent: str) -> Iterator[str]:
    """Yield a docstring, on one line if it fits; nothing for an empty text."""
    lines = _wrap(text, indent + '"""')
    if not lines:
        return
    if len(lines) == 1 and len(indent) + len(lines[0]) + 2 * len('"""') <= _WIDTH:
        yield f'{indent}"""{lines[0]}"""'
        return
    yield f'{indent}"""{lines[0]}'
    yield from (f"{indent}{line}" for line in lines[1:])
    yield f'{indent}"""'


def _wrap(text: str, indent: str) -> list[str]:
    """Wrap a text for a docstring, without backslashes and double quotes, which could end the docstring."""
    # the docstring is for readers, the schema has the exact text
    text = text.replace("\\", "/").replace('"', "'")
    return textwrap.wrap(text, _WIDTH - len(indent), break_on_hyphens=False)


def _format_literal(value: bool | float | str) -> str:
    """Return the Python literal of a constant."""
    if isinstance(value, str) and '"' not in value:
        # a JSON string is a Python string with double quotes, which formatters want
        return json.dumps(value, ensure_ascii=False)
    return repr(value)
