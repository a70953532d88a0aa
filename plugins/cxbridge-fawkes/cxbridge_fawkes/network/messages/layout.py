"""Layouts of messages: fields of fixed size in the order of Fawkes' C structs, and an optional block."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from struct import Struct
from typing import Any, Final, NamedTuple
from uuid import UUID

from cxbridge.clock import join_us, split_us
from cxbridge.trace.formats.block_decoder import decode_padded_text
from cxbridge_fawkes.network.messages.fields import (
    check_min_size,
    check_size,
    pack_text,
)


class WireType(NamedTuple):
    """The encoding of a field, which may hold several attributes of a message.

    :param format: a :mod:`struct` format for one value.
    :param to_wire: converts the attributes for the format.
    :param from_wire: converts the value back to a tuple of the attributes.
    """

    format: str
    to_wire: Callable[..., Any]
    from_wire: Callable[[Any], tuple[Any, ...]]


def _return_unchanged(value: Any) -> Any:
    return value


def _as_tuple(value: Any) -> tuple[Any]:
    return (value,)


WORD: Final = WireType("I", _return_unchanged, _as_tuple)
"""A 32-bit number."""

SERIAL: Final = WireType("16s", lambda serial: serial.bytes, lambda raw: (UUID(bytes=raw),))
"""The serial of an instance."""

_HAS_WRITER_BIT: Final = 1 << 31  # the highest bit of the number of readers


def _pack_presence(has_writer: bool, num_readers: int) -> int:
    return (_HAS_WRITER_BIT if has_writer else 0) | min(num_readers, _HAS_WRITER_BIT - 1)


PRESENCE: Final = WireType(
    "I", _pack_presence, lambda word: (bool(word & _HAS_WRITER_BIT), word & ~_HAS_WRITER_BIT)
)
"""The presence of a writer and the number of readers, in one word."""

# in the byte order of the sender, unlike all other numbers, because Fawkes copies its C struct
_STAMP: Final = Struct("=qq")
STAMP: Final = WireType(
    f"{_STAMP.size}s",
    lambda time_us: _STAMP.pack(*split_us(time_us)),
    lambda raw: (join_us(*_STAMP.unpack(raw)),),
)
"""Microseconds since the epoch, as seconds and microseconds."""


def raw_type(size: int) -> WireType:
    """Return the type of raw bytes."""
    return WireType(f"{size}s", _return_unchanged, _as_tuple)


def text_type(size: int, *, terminated: bool = True) -> WireType:
    """Return the type of a text padded with NUL, see :func:`~.fields.pack_text`."""
    return WireType(
        f"{size}s",
        lambda value: pack_text(value, size, terminated=terminated),
        lambda raw: (decode_padded_text(raw),),
    )


class Layout:
    """The fields of a message in wire order.

    :param name: the name of the message, for errors.
    :param fields: the type of each field by the names of its attributes, which are separated by blanks.
    :param has_block: whether the size of a block and the block follow the fields.
    """

    def __init__(
        self, name: str, fields: Mapping[str, WireType] | None = None, *, has_block: bool = False
    ) -> None:
        self._name: Final = name
        # the names of the attributes in each field, and its type
        self._fields: Final = [(names.split(), wire_type) for names, wire_type in (fields or {}).items()]
        self._has_block: Final = has_block
        formats = "".join(wire_type.format for _, wire_type in self._fields)
        self._head: Final = Struct(f">{formats}{'I' if has_block else ''}")  # I: the size of the block

    @property
    def size(self) -> int:
        """The size without the block."""
        return self._head.size

    def pack(self, message: Any) -> bytes:
        """Return the bytes of a message, including its attribute ``block``."""
        values = [
            wire_type.to_wire(*(getattr(message, name) for name in names))
            for names, wire_type in self._fields
        ]
        if not self._has_block:
            return self._head.pack(*values)
        block: bytes = message.block
        return self._head.pack(*values, len(block)) + block

    def unpack(self, payload: bytes) -> dict[str, Any]:
        """Return the attributes by name.

        :raises MalformedMessageError: if the size is wrong.
        """
        (check_min_size if self._has_block else check_size)(payload, self.size, self._name)
        values = self._head.unpack_from(payload)
        attributes: dict[str, Any] = {}
        # not strict: the last value may be the size of the block, which has no field
        for (names, wire_type), value in zip(self._fields, values, strict=False):
            attributes.update(zip(names, wire_type.from_wire(value), strict=True))
        if self._has_block:
            check_size(payload, self.size + values[-1], self._name)
            attributes["block"] = payload[self.size :]
        return attributes
