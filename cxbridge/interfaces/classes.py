"""Makes the Python classes of a schema: enums, messages, the interface.

The class of an interface or a message has a property for each field.
"""

from __future__ import annotations

import ctypes
import keyword
from enum import IntEnum
from functools import cache
from operator import attrgetter
from typing import Any

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.accessors import make_accessor
from cxbridge.interfaces.block import Block
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.schema import EnumSchema, FieldSchema, InterfaceSchema, MessageSchema

EnumClasses = dict[str, type[IntEnum]]


@cache
def make_interface_class(schema: InterfaceSchema) -> type[Interface]:
    """Return the class of an interface, always the same class for equal schemas.

    The class has a property for each field, and attributes for message classes, enums, enum items and
    constants.

    :raises InterfaceError: if the layout of the schema differs from that of a C struct on this machine.
    """
    enums = {enum.name: make_enum(enum) for enum in schema.enums}
    messages = {message.name: _make_message_class(message, schema, enums) for message in schema.messages}
    namespace = {"__slots__": (), "__doc__": schema.comment or schema.name, "MESSAGES": messages}
    interface_class = type(schema.name, (Interface,), namespace)
    _add_fields(interface_class, schema, enums)
    members: dict[str, Any] = {**enums, **messages}
    members |= {constant.name: constant.value for constant in schema.constants}
    for enum in schema.enums:
        members |= {item.name: enums[enum.name](item.value) for item in enum.items}
    for name, value in members.items():
        setattr(interface_class, attribute_name(name, Interface), value)
    return interface_class


@cache
def make_enum(schema: EnumSchema) -> type[IntEnum]:
    """Return the class of an enum, always the same class for equal schemas."""
    items = [(enum_member_name(item.name), item.value) for item in schema.items]
    enum = IntEnum(schema.name, items)  # type: ignore[misc]  # mypy expects a literal name
    enum.__doc__ = schema.comment
    return enum


def enum_member_name(name: str) -> str:
    """Return the name of an enum item in Python, with an underscore if the name is reserved."""
    # Python's enums refuse names such as _x_ and the name mro, and take __x__ for an attribute
    is_reserved = keyword.iskeyword(name) or name == "mro" or (name.startswith("_") and name.endswith("_"))
    return f"{name}_" if is_reserved else name


def attribute_name(name: str, base: type) -> str:
    """Return the attribute for a name in a definition, with an underscore if the name is reserved.

    Reserved are Python's keywords, the attributes of ``base``, and those declared in :class:`Block`.
    """
    is_taken = keyword.iskeyword(name) or name in Block.__annotations__ or hasattr(base, name)
    return f"{name}_" if is_taken else name


def make_view(fields: tuple[FieldSchema, ...], datasize: int) -> type[ctypes.Structure]:
    """Return the C struct of a block: the time stamp, then f0, f1, ... in the order of declaration.

    :raises InterfaceError: if the layout of the schema differs from that of the C struct.
    """
    members: list[tuple[str, Any]] = [("sec", ctypes.c_int64), ("usec", ctypes.c_int64)]
    for number, field in enumerate(fields):
        c_type = field.storage.c_type
        members.append((f"f{number}", c_type if field.length is None else c_type * field.length))
    view = type("View", (ctypes.Structure,), {"_fields_": members})
    # a recording or a compiled module may have a schema of another version
    offsets = [getattr(view, f"f{number}").offset for number in range(len(fields))]
    if ctypes.sizeof(view) != datasize or offsets != [field.offset for field in fields]:
        raise InterfaceError("the layout of this schema differs from that of a C struct on this machine")
    return view


def _add_fields(
    block_class: type[Block], schema: InterfaceSchema | MessageSchema, enums: EnumClasses
) -> None:
    """Give a class its schema and the properties of its fields."""
    block_class.SCHEMA = schema
    block_class.VIEW = make_view(schema.fields, schema.datasize)
    block_class.ACCESSORS = {
        field.name: make_accessor(
            schema.name, field, number, enums.get(field.type) if field.is_enum else None
        )
        for number, field in enumerate(schema.fields)
    }
    names = [f"f{number}" for number in range(len(schema.fields))]
    # two more names, because attrgetter returns a tuple only for two or more
    block_class.READ_FIELDS = attrgetter(*names, "__class__", "__class__")
    block_class.CONVERTED_FIELDS = tuple(
        field.name for field in schema.fields if field.is_string or field.is_array or field.is_enum
    )
    base = Message if isinstance(schema, MessageSchema) else Interface
    for name, accessor in block_class.ACCESSORS.items():
        setattr(block_class, attribute_name(name, base), accessor)


def _make_message_class(
    schema: MessageSchema, interface: InterfaceSchema, enums: EnumClasses
) -> type[Message]:
    namespace = {
        "__slots__": (),
        "__doc__": schema.comment or schema.name,
        "__qualname__": f"{interface.name}.{schema.name}",
        "INTERFACE": interface,
    }
    message_class = type(schema.name, (Message,), namespace)
    _add_fields(message_class, schema, enums)
    return message_class
