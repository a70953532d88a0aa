"""Makes the Python classes of a schema: enums, messages, the interface.

A class has a property for each field. Classes come from XML at run time, or from modules that
``cxbridge interface compile`` has written, which :func:`define` completes.
"""

from __future__ import annotations

import ctypes
import keyword
from collections.abc import Callable
from enum import IntEnum
from functools import cache
from operator import attrgetter
from typing import Any, TypeVar

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.accessors import make_accessor, make_filler
from cxbridge.interfaces.block import Block
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.pseudomap import pseudomap_property
from cxbridge.interfaces.schema import EnumSchema, FieldSchema, InterfaceSchema, MessageSchema

EnumClasses = dict[str, type[IntEnum]]
BlockT = TypeVar("BlockT", bound=Block)
InterfaceT = TypeVar("InterfaceT", bound=Interface)

_UNKNOWN = "UNKNOWN"
_C_TYPES: dict[str, Any] = {
    "?": ctypes.c_bool,
    "b": ctypes.c_int8,
    "B": ctypes.c_uint8,
    "h": ctypes.c_int16,
    "H": ctypes.c_uint16,
    "i": ctypes.c_int32,
    "I": ctypes.c_uint32,
    "q": ctypes.c_int64,
    "Q": ctypes.c_uint64,
    "f": ctypes.c_float,
    "d": ctypes.c_double,
    "s": ctypes.c_char,
}


@cache
def make_interface_class(schema: InterfaceSchema) -> type[Interface]:
    """Return the class of an interface, always the same class for equal schemas.

    The class has a property for each field, attributes for message classes, enums, enum items and constants,
    and a function ``tostring_ENUM(value)`` for each enum.
    """
    interface_class = type(
        schema.name, (Interface,), {"__slots__": (), "__doc__": schema.comment or schema.name}
    )
    return define(schema)(interface_class)


def define(schema: InterfaceSchema) -> Callable[[type[InterfaceT]], type[InterfaceT]]:
    """Return a decorator that completes the class of an interface.

    The class keeps the enums and messages that its body defines.
    """

    def complete(interface_class: type[InterfaceT]) -> type[InterfaceT]:
        # a compiled class defines typed enums and messages; a class from XML gets them here
        enums = {
            enum.name: _own_attribute(interface_class, enum.name) or make_enum(enum) for enum in schema.enums
        }
        messages: dict[str, type[Message]] = {}
        for message in schema.messages:
            message_class = _own_attribute(interface_class, message.name) or _make_message_class(
                message, schema
            )
            messages[message.name] = _add_fields(message_class, message, enums)
            message_class.INTERFACE = schema
            message_class.FILL = make_filler(
                message.fields, [enums.get(field.type) if field.is_enum else None for field in message.fields]
            )
        interface_class.MESSAGES = messages
        _add_fields(interface_class, schema, enums)
        for pseudomap in schema.pseudomaps:
            setattr(interface_class, attribute_name(pseudomap.name, Interface), pseudomap_property(pseudomap))
        _add_members(interface_class, {**enums, **messages})
        _add_members(interface_class, {constant.name: constant.value for constant in schema.constants})
        for definition in schema.enums:
            enum = enums[definition.name]
            _add_members(interface_class, {f"tostring_{definition.name}": staticmethod(_make_tostring(enum))})
            _add_members(interface_class, {item.name: enum(item.value) for item in definition.items})
        return interface_class

    return complete


@cache
def make_enum(schema: EnumSchema) -> type[IntEnum]:
    """Return the class of an enum, always the same class for equal schemas."""
    items = [(enum_member_name(item.name), item.value) for item in schema.items]
    enum = IntEnum(schema.name, items)  # type: ignore[misc]
    enum.__doc__ = schema.comment
    return enum


def enum_member_name(name: str) -> str:
    """Return the name of an enum item in Python, with an underscore if the name is reserved."""
    # Python's enums refuse an item called mro, and treat names with underscores at both ends as attributes
    reserved = keyword.iskeyword(name) or name == "mro" or (name.startswith("_") and name.endswith("_"))
    return f"{name}_" if reserved else name


def attribute_name(name: str, base: type) -> str:
    """Return the attribute for a name in a definition, with an underscore if ``base`` uses the name."""
    is_taken = keyword.iskeyword(name) or name in Block.__annotations__ or hasattr(base, name)
    return f"{name}_" if is_taken else name


def make_view(fields: tuple[FieldSchema, ...], datasize: int) -> type[ctypes.Structure]:
    """Return the C struct of a block: the time stamp, then f0, f1, ... in the order of declaration.

    :raises InterfaceError: if the layout of the schema differs from that of the C struct.
    """
    members: list[tuple[str, Any]] = [("sec", ctypes.c_int64), ("usec", ctypes.c_int64)]
    for number, field in enumerate(fields):
        c_type = _C_TYPES[field.storage.code]
        members.append((f"f{number}", c_type if field.length is None else c_type * field.length))
    view = type("View", (ctypes.Structure,), {"_fields_": members})
    # a recording or a compiled module may have a schema of another version
    offsets = [getattr(view, f"f{number}").offset for number in range(len(fields))]
    if ctypes.sizeof(view) != datasize or offsets != [field.offset for field in fields]:
        raise InterfaceError("the layout of this schema differs from that of a C struct on this machine")
    return view


def _add_fields(
    block_class: type[BlockT], schema: InterfaceSchema | MessageSchema, enums: EnumClasses
) -> type[BlockT]:
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
    return block_class


def _own_attribute(interface_class: type[Interface], name: str) -> Any:
    """Return the attribute that the class body defines for a name of the definition, or None."""
    return vars(interface_class).get(attribute_name(name, Interface))


def _make_message_class(schema: MessageSchema, interface: InterfaceSchema) -> type[Message]:
    """Return a message class without fields."""
    namespace = {
        "__slots__": (),
        "__doc__": schema.comment or schema.name,
        "__qualname__": f"{interface.name}.{schema.name}",
    }
    return type(schema.name, (Message,), namespace)


def _add_members(interface_class: type[Interface], members: dict[str, Any]) -> None:
    """Add class attributes by names of the definition unless the class body defines them."""
    for name, value in members.items():
        attribute = attribute_name(name, Interface)
        if attribute not in vars(interface_class):
            setattr(interface_class, attribute, value)


def enum_value_name(enum: type[IntEnum], value: int) -> str:
    """Return the name of an enum value, or ``UNKNOWN``."""
    return next((item.name for item in enum if item == value), _UNKNOWN)


def _make_tostring(enum: type[IntEnum]) -> Callable[[int], str]:
    def tostring(value: int) -> str:
        """Return the name of a value, or UNKNOWN."""
        return enum_value_name(enum, value)

    return tostring
