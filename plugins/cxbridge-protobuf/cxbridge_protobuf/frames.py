"""Frames to bytes and back. Format: docs/evidence/protocol-protobuf.md."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cxbridge.errors import ProtobufError

_HEADER_V1: Final = struct.Struct("!HHI")
_HEADER_V2: Final = struct.Struct("!BBxxI")
_MESSAGE_HEADER: Final = struct.Struct("!HH")

VERSIONS: Final = (1, 2)
"""The versions of frames there are."""

NO_CIPHER: Final = 0


@dataclass(frozen=True, slots=True)
class Frame:
    """One message on its way.

    :param component: component id, 0 to 65535.
    :param type: message type, 0 to 65535.
    :param data: the encoded message.
    """

    component: int
    type: int
    data: bytes


def encode(frame: Frame, version: int = 2) -> bytes:
    """Return the bytes of a frame that is not encrypted."""
    if version == 1:
        return _HEADER_V1.pack(frame.component, frame.type, len(frame.data)) + frame.data
    return seal(NO_CIPHER, payload(frame))


def payload(frame: Frame) -> bytes:
    """Return what follows the header of a frame of version 2: that which gets encrypted."""
    return _MESSAGE_HEADER.pack(frame.component, frame.type) + frame.data


def seal(cipher: int, content: bytes) -> bytes:
    """Put the header of version 2 before a payload.

    :param cipher: the number of the cipher that it is encrypted with, 0 when it is not.
    """
    return _HEADER_V2.pack(2, cipher, len(content)) + content


def parse_payload(content: bytes) -> Frame:
    """Return the frame of a payload of version 2.

    :raises ProtobufError: when it is too short.
    """
    if len(content) < _MESSAGE_HEADER.size:
        raise ProtobufError("the frame is too short for a message header")
    component, type_ = _MESSAGE_HEADER.unpack_from(content)
    return Frame(component, type_, content[_MESSAGE_HEADER.size :])


def open_datagram(data: bytes, version: int = 2) -> tuple[int, bytes]:
    """Return the cipher of a datagram and its payload, laid out as in version 2.

    The size in the header is not looked at when it is encrypted, as protobuf_comm does.

    :raises ProtobufError: when it is not a frame.
    """
    header = _HEADER_V1 if version == 1 else _HEADER_V2
    if len(data) < header.size:
        raise ProtobufError("the datagram is too short for a frame")
    if version == 1:
        component, type_, size = _HEADER_V1.unpack_from(data)
        content = payload(Frame(component, type_, data[header.size :]))
        cipher, size = NO_CIPHER, size + _MESSAGE_HEADER.size
    else:
        found, cipher, size = _HEADER_V2.unpack_from(data)
        content = data[header.size :]
        if found != version:
            raise ProtobufError(f"the datagram is not a frame of version {version}")
    if cipher == NO_CIPHER and size != len(content):
        raise ProtobufError(f"the frame reports {size} bytes and has {len(content)}")
    return cipher, content


class StreamDecoder:
    """Cuts a stream of bytes into frames.

    :param max_size: bytes that a frame may announce after its header.
    :param version: of the frames.
    """

    def __init__(self, max_size: int, version: int = 2) -> None:
        self._max_size = max_size
        self._version = version
        self._header = _HEADER_V1 if version == 1 else _HEADER_V2
        self._buffer = bytearray()

    def feed(self, data: bytes) -> Iterator[Frame]:
        """Take the next bytes and yield the frames that are complete now.

        :raises ProtobufError: when no frame can follow any more: the stream is in another version or
            encrypted, or its next frame is too long or too short. The decoder must not be used again.
        """
        self._buffer += data
        start, header = 0, self._header
        while len(self._buffer) - start >= header.size:
            end = start + header.size + self._size(start)
            if len(self._buffer) < end:
                break
            content = bytes(self._buffer[start + header.size : end])
            if self._version == 1:
                component, type_, _ = header.unpack_from(self._buffer, start)
                yield Frame(component, type_, content)
            else:
                yield parse_payload(content)
            start = end
        del self._buffer[:start]

    def _size(self, start: int) -> int:
        """Return the size that the frame at an offset announces."""
        if self._version == 1:
            size = int(self._header.unpack_from(self._buffer, start)[2])
            least = 0
        else:
            version, cipher, size = self._header.unpack_from(self._buffer, start)
            least = _MESSAGE_HEADER.size
            if version != self._version:
                raise ProtobufError(f"the stream has no frames of version {self._version}")
            if cipher != NO_CIPHER:
                raise ProtobufError("a frame is encrypted, which streams never are")
        if not least <= size <= self._max_size:
            raise ProtobufError(f"a frame reports {size} bytes, {least} to {self._max_size} are allowed")
        return int(size)
