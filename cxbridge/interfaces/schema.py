"""The schema of an interface as plain immutable values. Knows nothing of XML or of Python classes."""

from __future__ import annotations

from functools import cached_property

from msgspec import Struct

from cxbridge.interfaces.fieldtypes import FieldType, storage_type


class EnumItem(Struct, frozen=True):
    """A named number of an enum."""

    name: str
    value: int
    comment: str = ""


class EnumSchema(Struct, frozen=True):
    """An enum that a definition declares; stored as a 32 bit signed integer."""

    name: str
    items: tuple[EnumItem, ...]
    comment: str = ""


class ConstantSchema(Struct, frozen=True):
    """A constant of an interface. A ``float`` value is already rounded to 32 bits."""

    name: str
    type: str
    value: bool | int | float | str
    comment: str = ""


class FieldSchema(Struct, frozen=True):
    """A field and its place in the block.

    :param name: the name of the field.
    :param type: the type as XML spells it: a built-in one, or the name of an enum.
    :param length: elements of an array, bytes of a string with its terminating NUL; None for a single value.
    :param offset: bytes from the start of the block.
    :param size: bytes of the whole field.
    :param elem_size: bytes of one element, which is its alignment.
    :param comment: the purpose of the field.
    :param enum: the enum, when the type is one.
    :param validfor: the unchanged text; Fawkes checks it and does not use it.
    :param default: the unchanged text; Fawkes checks it and does not use it (blocks begin as zeros).
    :param flags: ``changed_indicator`` or nothing; kept, not used.
    """

    name: str
    type: str
    length: int | None
    offset: int
    size: int
    elem_size: int
    comment: str = ""
    enum: EnumSchema | None = None
    validfor: str | None = None
    default: str | None = None
    flags: tuple[str, ...] = ()

    @property
    def storage(self) -> FieldType:
        """How one element is stored."""
        return storage_type(self.type)

    @property
    def is_enum(self) -> bool:
        """Whether the type is an enum of the same file."""
        return self.enum is not None

    @property
    def is_string(self) -> bool:
        """Whether this is text."""
        return self.type == "string"

    @property
    def text_room(self) -> int:
        """The bytes that a text may have: the last byte stays for the NUL, unless it is a single ``char``."""
        return 1 if self.length is None else self.length - 1

    @property
    def is_array(self) -> bool:
        """Whether the field was declared with a length and is not a string; so its value is a tuple.

        A ``length="1"`` makes an array of one element, as in Fawkes' C struct. Fawkes' introspection
        (CLIPS, Lua, loggers) calls it a single value: ask :attr:`runtime_length` for that view.
        """
        return self.length is not None and not self.is_string

    @property
    def runtime_length(self) -> int:
        """The length as Fawkes' introspection reports it: 1 for a single value."""
        return 1 if self.length is None else self.length

    @property
    def runtime_type(self) -> str:
        """The type's name as Fawkes' introspection reports it."""
        return self.type


class MapRef(Struct, frozen=True):
    """One entry of a pseudo map: the field that a key stands for."""

    field: str
    key: str


class PseudoMapSchema(Struct, frozen=True):
    """Access to single fields by a number; holds no data."""

    name: str
    type: str
    keytype: str
    refs: tuple[MapRef, ...]
    comment: str = ""


class MessageSchema(Struct, frozen=True):
    """A message of an interface; the name carries the suffix ``Message``."""

    name: str
    datasize: int
    fields: tuple[FieldSchema, ...]
    comment: str = ""

    def field(self, name: str) -> FieldSchema | None:
        """Return the field of that name, None when there is none."""
        return next((field for field in self.fields if field.name == name), None)


class InterfaceSchema(Struct, frozen=True, dict=True):
    """A whole interface definition with its layout.

    :param name: the type's name; carries the suffix ``Interface``.
    :param hash: 16 bytes, the MD5 of the definition file's bytes.
    :param datasize: bytes of the block, a multiple of 8.
    :param source: the file it was read from, empty when it was not a file.
    """

    name: str
    hash: bytes
    datasize: int
    fields: tuple[FieldSchema, ...]
    messages: tuple[MessageSchema, ...] = ()
    enums: tuple[EnumSchema, ...] = ()
    constants: tuple[ConstantSchema, ...] = ()
    pseudomaps: tuple[PseudoMapSchema, ...] = ()
    comment: str = ""
    author: str = ""
    year: str = ""
    created: str = ""
    source: str = ""

    @property
    def hash_printable(self) -> str:
        """The hash as Fawkes prints it: 32 upper case hexadecimal digits."""
        return self.hash.hex().upper()

    @cached_property
    def _fields_by_name(self) -> dict[str, FieldSchema]:
        return {field.name: field for field in self.fields}

    def field(self, name: str) -> FieldSchema | None:
        """Return the data field of that name, None when there is none."""
        return self._fields_by_name.get(name)

    def message(self, name: str) -> MessageSchema | None:
        """Return the message of that full name (with its suffix), None when there is none."""
        return next((message for message in self.messages if message.name == name), None)
