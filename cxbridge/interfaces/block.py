"""Blocks: the bytes of an interface or message, and access to their fields."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from operator import attrgetter
from struct import Struct
from typing import Any, ClassVar, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import InterfaceError
from cxbridge.interfaces.schema import FieldSchema

STAMP: Final = Struct("=qq")
"""The head of blocks: seconds and microseconds since the epoch, in the host's byte order."""


class Block:
    """The bytes of an interface or message as in Fawkes' C struct, with a property for each field.

    :mod:`cxbridge.interfaces.classes` makes the classes with fields. A field whose name is a Python
    keyword or an attribute of the class has the property ``name_``; `get` and `set` take the original name.

    Views refer to the buffer: write into ``_buf[:]``, and never replace the buffer.
    """

    __slots__ = ("_buf", "_changed", "_refreshed", "_view")

    SCHEMA: ClassVar[Any]
    """The schema, an ``InterfaceSchema`` or a ``MessageSchema``."""

    VIEW: ClassVar[type[ctypes.Structure]]
    """The C struct of the block; its fields are f0, f1, ... in the order of declaration."""

    ACCESSORS: ClassVar[dict[str, Any]]
    """The properties by field name in the definition."""

    # one call for all fields takes a third of the time of all properties
    READ_FIELDS: ClassVar[attrgetter[tuple[Any, ...]]]
    """Returns all fields of a view in order, followed by padding values."""

    CONVERTED_FIELDS: ClassVar[tuple[str, ...]]
    """The fields whose values differ between view and property."""

    def __init__(self) -> None:
        """Make a block of zeros."""
        self._buf = bytearray(self.SCHEMA.datasize)
        self._view = self.VIEW.from_buffer(self._buf)
        self._changed = False  # whether a property's setter changed a value since the last write
        self._refreshed = False  # whether a setter was called since the last write, even with an equal value

    @classmethod
    def fields(cls) -> tuple[FieldSchema, ...]:
        """Return the fields in the order of declaration."""
        fields: tuple[FieldSchema, ...] = cls.SCHEMA.fields
        return fields

    @classmethod
    def field(cls, name: str) -> FieldSchema:
        """Return a field.

        :raises InterfaceError: if there is no such field.
        """
        field: FieldSchema | None = cls.SCHEMA.field(name)
        if field is None:
            names = ", ".join(field.name for field in cls.fields())
            raise InterfaceError(
                f"{cls.SCHEMA.name} has no field '{name}'", hint=f"it has {names or 'no fields'}"
            )
        return field

    @classmethod
    def maxlenof(cls, name: str) -> int:
        """Return the length of an array or string, 1 for a single value (``maxlenof_NAME()`` in Fawkes).

        :raises InterfaceError: if there is no such field.
        """
        return cls.field(name).runtime_length

    def get(self, name: str, index: int | None = None) -> Any:
        """Return the value of a field, or an element of an array.

        :param index: the index of the element; None: the whole value.
        :raises InterfaceError: if there is no such field or element.
        """
        accessor = self._accessor(name)
        value = accessor.fget(self)
        if index is None:
            return value
        return value[self._valid_index(self.field(name), index)]

    def set(self, name: str, value: Any, index: int | None = None) -> None:
        """Set a field, or the element ``index`` of an array; enum values may be names or numbers.

        Like Fawkes' generic access (field iterators, CLIPS), this method marks the block as refreshed but
        never as changed.

        :raises InterfaceError: if there is no such field or element, or the value does not fit.
        """
        accessor = self._accessor(name)
        if index is not None:
            valid_index = self._valid_index(self.field(name), index)
            elements = list(accessor.fget(self))
            elements[valid_index] = value
            value = elements
        was_changed = self._changed
        accessor.fset(self, value)
        self._changed = was_changed

    def _accessor(self, name: str) -> Any:
        """Return the property of a field.

        :raises InterfaceError: if there is no such field.
        """
        accessor = self.ACCESSORS.get(name)
        # field() raises the error for an unknown name
        return self.ACCESSORS[self.field(name).name] if accessor is None else accessor

    def as_dict(self) -> dict[str, Any]:
        """Return all values by field name, in the order of declaration."""
        # one call reads all fields, then properties convert texts, arrays and enums; not strict, because
        # READ_FIELDS appends padding values
        values = dict(zip(self.ACCESSORS, self.READ_FIELDS(self._view), strict=False))
        for name in self.CONVERTED_FIELDS:
            values[name] = self.ACCESSORS[name].fget(self)
        return values

    def to_bytes(self) -> bytes:
        """Return the whole block including the time stamp, in the byte order of the host."""
        return bytes(self._buf)

    def set_from_chunk(self, chunk: bytes | bytearray | memoryview | Sequence[int]) -> None:
        """Replace the whole block including the time stamp, without marking it as refreshed or changed.

        :raises InterfaceError: if the size is wrong.
        """
        if len(chunk) != len(self._buf):
            raise InterfaceError(
                f"a block of {self.SCHEMA.name} has {len(self._buf)} bytes, not {len(chunk)}",
                hint="both sides must use the same definition of the interface",
            )
        self._buf[:] = bytes(chunk)

    @property
    def timestamp_us(self) -> int:
        """The time stamp in microseconds since the epoch, 0 if it was never set."""
        seconds, microseconds = STAMP.unpack_from(self._buf)
        return int(seconds) * MICROSECONDS + int(microseconds)

    def _valid_index(self, field: FieldSchema, index: int) -> int:
        """Return an index of an element.

        :raises InterfaceError: if the field has no such element.
        """
        if not field.is_array:
            raise InterfaceError(f"{self.SCHEMA.name}.{field.name} is a single value and has no index")
        if not 0 <= index < field.runtime_length:
            # the text of Fawkes
            raise InterfaceError(f"Index value {index} is out of bounds (0..{field.runtime_length - 1})")
        return index
