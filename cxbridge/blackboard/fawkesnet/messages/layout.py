"""Layouts of messages: fields of fixed size, and an optional final block."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from struct import Struct
from typing import Any, Final, NamedTuple
from uuid import UUID

from cxbridge.blackboard.fawkesnet.messages.fields import (
    expect_at_least,
    expect_size,
    pack_text,
    unpack_text,
)


class WireType(NamedTuple):
    """The encoding of a field.

    :param format: a :mod:`struct` format for one value.
    :param to_wire: converts a field's value for the format.
    :param from_wire: converts it back.
    """

    format: str
    to_wire: Callable[[Any], Any]
    from_wire: Callable[[Any], Any]


def _unchanged(value: Any) -> Any:
    return value


WORD: Final = WireType("I", _unchanged, _unchanged)
"""A 32-bit number."""

SERIAL: Final = WireType("16s", lambda serial: serial.bytes, lambda raw: UUID(bytes=raw))
"""The serial of an instance."""


def raw(size: int) -> WireType:
    """Return the type of raw bytes."""
    return WireType(f"{size}s", _unchanged, _unchanged)


def text(size: int, *, terminated: bool = True) -> WireType:
    """Return the type of a text padded with NUL, see :func:`~.fields.pack_text`."""
    return WireType(f"{size}s", lambda value: pack_text(value, size, terminated=terminated), unpack_text)


class Layout:
    """The fields of a message in wire order.

    :param name: the name of the message, for errors.
    :param fields: types by attribute name.
    :param block: whether a block with its size follows.
    """

    def __init__(
        self, name: str, fields: Mapping[str, WireType] | None = None, *, block: bool = False
    ) -> None:
        fields = fields or {}
        self._name: Final = name
        self._fields: Final = fields
        self._has_block: Final = block
        self._head: Final = Struct(">" + "".join(field.format for field in fields.values()) + "I" * block)

    @property
    def size(self) -> int:
        """The size without the block."""
        return self._head.size

    def pack(self, value: Any) -> bytes:
        """Return the bytes of a value, including its attribute ``block``."""
        words = [one.to_wire(getattr(value, name)) for name, one in self._fields.items()]
        if not self._has_block:
            return self._head.pack(*words)
        block: bytes = value.block
        return self._head.pack(*words, len(block)) + block

    def unpack(self, payload: bytes) -> dict[str, Any]:
        """Return the attributes by name.

        :raises MalformedMessageError: if the size is wrong.
        """
        (expect_at_least if self._has_block else expect_size)(payload, self.size, self._name)
        words = self._head.unpack_from(payload)
        found = {
            name: one.from_wire(word) for (name, one), word in zip(self._fields.items(), words, strict=False)
        }
        if self._has_block:
            expect_size(payload, self.size + words[-1], self._name)
            found["block"] = payload[self.size :]
        return found
