"""Common parts of the messages of all components: the base class, texts of fixed size, and lists."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from struct import Struct
from typing import ClassVar, Final

from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame

LIST_HEAD: Final = Struct(">II")
"""The total size of the following elements, and their number."""

_LENGTH: Final = Struct(">H")  # the length before each element, in bytes

# in Fawkes, an element and its two bytes of length have at most 65535 bytes
MAX_ELEMENT_BYTES: Final = 65533
"""The maximum size of a list element in bytes; callers of `pack_list` drop or cut longer elements."""


class WireValue(ABC):
    """The base class of all messages as typed values."""

    __slots__ = ()

    COMPONENT: ClassVar[ComponentId]

    @property
    @abstractmethod
    def message_kind(self) -> int:
        """The number of the message within its component."""

    @abstractmethod
    def pack(self) -> bytes:
        """Return the payload."""

    def to_frame(self) -> FawkesFrame:
        return FawkesFrame(self.COMPONENT, self.message_kind, self.pack())

    def to_bytes(self) -> bytes:
        """Return the frame as bytes."""
        return self.to_frame().to_bytes()


def check_size(payload: bytes, size: int, subject: str) -> None:
    """Check the size of a payload.

    :param subject: the name of the payload, for errors.
    :raises MalformedMessageError: if the size differs from ``size``.
    """
    if len(payload) != size:
        raise MalformedMessageError(f"{subject} has {len(payload)} bytes, not {size}")


def check_min_size(payload: bytes, size: int, subject: str) -> None:
    """Check the minimum size of a payload.

    :param subject: the name of the payload, for errors.
    :raises MalformedMessageError: if the payload is shorter than ``size``.
    """
    if len(payload) < size:
        raise MalformedMessageError(f"{subject} has {len(payload)} bytes, but needs at least {size}")


def pack_text(text: str, size: int, *, terminated: bool = True) -> bytes:
    """Return a text padded with NUL to ``size`` bytes; a longer text is cut.

    :param terminated: whether the last byte must be NUL.
    """
    room = size - 1 if terminated else size
    return text.encode(errors="replace")[:room].ljust(size, b"\0")


def pack_list(elements: Iterable[bytes]) -> bytes:
    """Return the bytes of a list: its head, then each element after its length.

    :param elements: each of at most `MAX_ELEMENT_BYTES`.
    """
    packed_elements = [_LENGTH.pack(len(element)) + element for element in elements]
    body = b"".join(packed_elements)
    return LIST_HEAD.pack(len(body), len(packed_elements)) + body


def unpack_list(payload: bytes, subject: str) -> tuple[bytes, ...]:
    """Return the elements of a list.

    :param subject: the name of the list, for errors.
    :raises MalformedMessageError: if the head or a length does not match the bytes.
    """
    check_min_size(payload, LIST_HEAD.size, subject)
    size, count = LIST_HEAD.unpack_from(payload)
    end = len(payload)
    if size != end - LIST_HEAD.size:
        raise MalformedMessageError(f"{subject} announces {size} bytes, but has {end - LIST_HEAD.size}")
    elements = []
    start = LIST_HEAD.size
    while start < end:
        if end - start < _LENGTH.size:
            raise MalformedMessageError(f"{subject} ends within the length of an element")
        element_end = start + _LENGTH.size + _LENGTH.unpack_from(payload, start)[0]
        if element_end > end:
            raise MalformedMessageError(f"{subject} ends within an element")
        elements.append(payload[start + _LENGTH.size : element_end])
        start = element_end
    if len(elements) & 0xFFFF != count & 0xFFFF:  # Fawkes' counter has 16 bits
        raise MalformedMessageError(f"{subject} announces {count} elements, but has {len(elements)}")
    return tuple(elements)
