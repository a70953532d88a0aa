"""The building blocks of all messages: texts of fixed size and lists."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from struct import Struct
from typing import ClassVar, Final

from cxbridge.blackboard.fawkesnet.errors import MalformedMessageError
from cxbridge.blackboard.fawkesnet.messages.frames import ComponentId, FawkesFrame

LIST_HEAD: Final = Struct(">II")
"""Bytes and number of the elements that follow."""

_LENGTH: Final = Struct(">H")

MAX_ELEMENT: Final = 65533
"""Bytes that an element of a list may have."""


class WireValue(ABC):
    """A message of a component as a typed value; the base of the classes of all messages."""

    __slots__ = ()

    COMPONENT: ClassVar[ComponentId]

    @property
    @abstractmethod
    def message_kind(self) -> int:
        """Return the number of the message within its component."""

    @abstractmethod
    def pack(self) -> bytes:
        """Return the payload."""

    def to_frame(self) -> FawkesFrame:
        """Return the frame that carries it."""
        return FawkesFrame(self.COMPONENT, self.message_kind, self.pack())

    def to_bytes(self) -> bytes:
        """Return the frame as bytes."""
        return self.to_frame().to_bytes()


def expect_size(payload: bytes, size: int, part: str) -> None:
    """Refuse a payload that has not exactly ``size`` bytes.

    :raises MalformedMessageError: when it has not.
    """
    if len(payload) != size:
        raise MalformedMessageError(f"{part} has {len(payload)} bytes, not {size}")


def expect_at_least(payload: bytes, size: int, part: str) -> None:
    """Refuse a payload of less than ``size`` bytes.

    :raises MalformedMessageError: when it is shorter.
    """
    if len(payload) < size:
        raise MalformedMessageError(f"{part} has {len(payload)} bytes, at least {size} are needed")


def pack_text(text: str, size: int, *, terminated: bool = True) -> bytes:
    """Return ``text`` filled up with NUL to ``size`` bytes, cut when it is too long.

    :param terminated: whether there must be a NUL at the end.
    """
    room = size - 1 if terminated else size
    return text.encode(errors="replace")[:room].ljust(size, b"\0")


def unpack_text(raw: bytes) -> str:
    """Return the text before the first NUL; bytes that are not UTF-8 are written as escapes."""
    return raw.split(b"\0", 1)[0].decode(errors="backslashreplace")


def pack_list(elements: Iterable[bytes]) -> bytes:
    """Return a list: its head and its elements."""
    body = bytearray()
    count = 0
    for element in elements:
        body += _LENGTH.pack(len(element))
        body += element
        count += 1
    return LIST_HEAD.pack(len(body), count) + bytes(body)


def unpack_list(payload: bytes, part: str) -> tuple[bytes, ...]:
    """Return the elements of a list.

    :param part: the name of the list, for the error.
    :raises MalformedMessageError: when head, lengths and bytes do not fit together.
    """
    expect_at_least(payload, LIST_HEAD.size, part)
    size, count = LIST_HEAD.unpack_from(payload)
    end = len(payload)
    if size != end - LIST_HEAD.size:
        raise MalformedMessageError(f"{part} announces {size} bytes and has {end - LIST_HEAD.size}")
    elements = []
    start = LIST_HEAD.size
    while start < end:
        if end - start < _LENGTH.size:
            raise MalformedMessageError(f"{part} ends within the length of an element")
        after = start + _LENGTH.size + _LENGTH.unpack_from(payload, start)[0]
        if after > end:
            raise MalformedMessageError(f"{part} ends within an element")
        elements.append(payload[start + _LENGTH.size : after])
        start = after
    if len(elements) & 0xFFFF != count & 0xFFFF:  # Fawkes counts with 16 bits
        raise MalformedMessageError(f"{part} announces {count} elements and has {len(elements)}")
    return tuple(elements)
