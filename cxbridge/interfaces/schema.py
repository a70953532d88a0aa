"""Schemas of interfaces: immutable values, independent of XML and Python classes; their form in JSON."""

from __future__ import annotations

from functools import cached_property

from msgspec import Struct, json
from msgspec.structs import replace

from cxbridge.interfaces.fieldtypes import FieldType, storage_type


class EnumItem(Struct, frozen=True, omit_defaults=True):
    """A named number of an enum."""

    name: str
    value: int
    comment: str = ""


class EnumSchema(Struct, frozen=True, omit_defaults=True):
    """An enum of a definition, stored as a 32-bit signed integer."""

    name: str
    items: tuple[EnumItem, ...]
    comment: str = ""


class ConstantSchema(Struct, frozen=True, omit_defaults=True):
    """A constant of an interface; ``float`` values are rounded to 32 bits."""

    name: str
    type: str
    value: bool | int | float | str
    comment: str = ""


class FieldSchema(Struct, frozen=True, omit_defaults=True):
    """A field with its position in the block.

    :param type: a built-in type or the name of an enum, as in XML.
    :param length: the number of elements of an array, or of bytes of a string including NUL; None for a
        single value.
    :param offset: the number of bytes from the start of the block.
    :param size: the number of bytes of all elements.
    :param elem_size: the number of bytes of an element, also its alignment.
    :param enum: the enum that ``type`` names; None for a built-in type.
    :param default: the original text; None without a default. Fawkes does not use defaults: blocks start as
        zeros.
    :param flags: the flags of the definition. Fawkes accepts only ``changed_indicator``, without an effect.
    """

    name: str
    type: str
    length: int | None
    offset: int
    size: int
    elem_size: int
    comment: str = ""
    enum: EnumSchema | None = None
    default: str | None = None
    flags: tuple[str, ...] = ()

    @property
    def storage(self) -> FieldType:
        """The storage type of an element."""
        return storage_type(self.type)

    @property
    def is_enum(self) -> bool:
        """Whether the type is an enum of the same file."""
        return self.enum is not None

    @property
    def is_string(self) -> bool:
        return self.type == "string"

    @property
    def text_room(self) -> int:
        """The maximum number of bytes of a text."""
        # the last byte is for NUL; a string without length is a single char without NUL
        return 1 if self.length is None else self.length - 1

    @property
    def is_array(self) -> bool:
        """Whether the value of the field is a tuple: a field with a length that is not a string.

        A ``length="1"`` makes an array of one element, as in Fawkes' C struct. Fawkes' introspection (CLIPS,
        Lua, loggers) reports a single value, see `runtime_length`.
        """
        return self.length is not None and not self.is_string

    @property
    def runtime_length(self) -> int:
        """The length that Fawkes' introspection reports, 1 for a single value."""
        return 1 if self.length is None else self.length


class MessageSchema(Struct, frozen=True, omit_defaults=True):
    """A message of an interface; its name contains ``Message``.

    :param datasize: the number of bytes of the block, a multiple of 8.
    """

    name: str
    datasize: int
    fields: tuple[FieldSchema, ...]
    comment: str = ""

    def field(self, name: str) -> FieldSchema | None:
        """Return a field by name, or None."""
        return next((field for field in self.fields if field.name == name), None)


class InterfaceSchema(Struct, frozen=True, omit_defaults=True, dict=True):
    """An interface definition with its layout.

    :param name: the type's name, which contains ``Interface``.
    :param hash: the MD5 of the definition file, 16 bytes.
    :param datasize: the number of bytes of the block, a multiple of 8.
    :param source: the definition file, empty for a definition without a file.
    """

    name: str
    hash: bytes
    datasize: int
    fields: tuple[FieldSchema, ...]
    messages: tuple[MessageSchema, ...] = ()
    enums: tuple[EnumSchema, ...] = ()
    constants: tuple[ConstantSchema, ...] = ()
    comment: str = ""
    source: str = ""

    @property
    def hash_printable(self) -> str:
        """The hash in 32 upper case hexadecimal digits, as Fawkes prints it."""
        return self.hash.hex().upper()

    # a table, because each access to an interface by name looks up a field; a message has so few fields that
    # a search through all of them is as fast
    @cached_property
    def _fields_by_name(self) -> dict[str, FieldSchema]:
        return {field.name: field for field in self.fields}

    def field(self, name: str) -> FieldSchema | None:
        """Return a data field by name, or None."""
        return self._fields_by_name.get(name)


def schema_to_json(schema: InterfaceSchema) -> str:
    """Return a schema as indented JSON, without the file from which it was read."""
    return json.format(json.encode(replace(schema, source=""))).decode()


def schema_from_json(text: str) -> InterfaceSchema:
    """Return the schema in a text that :func:`schema_to_json` has written."""
    return json.decode(text, type=InterfaceSchema)
