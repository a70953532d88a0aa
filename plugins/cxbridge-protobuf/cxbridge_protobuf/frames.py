"""Encoding and decoding of frames. Format: docs/evidence/protocol-protobuf.md."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cxbridge.errors import ProtobufError

# Version 1: component id, message type, size. Version 2: version, cipher, two unused bytes, size; the ids are
# in the message header, which starts the payload.
_HEADER_V1: Final = struct.Struct("!HHI")
_HEADER_V2: Final = struct.Struct("!BBxxI")
_MESSAGE_HEADER: Final = struct.Struct("!HH")

VERSIONS: Final = (1, 2)  # the versions of frames that protobuf_comm has

NO_CIPHER: Final = 0


@dataclass(frozen=True, slots=True)
class Frame:
    """An encoded message with its ids.

    :param component: the component id, 0 to 65535.
    :param type: the number of the message type, 0 to 65535.
    :param data: the encoded message.
    """

    component: int
    type: int
    data: bytes


def encode(frame: Frame, version: int = 2) -> bytes:
    if version == 1:
        return _HEADER_V1.pack(frame.component, frame.type, len(frame.data)) + frame.data
    return seal(NO_CIPHER, payload(frame))


def payload(frame: Frame) -> bytes:
    """Return the payload of a version 2 frame, which is the part that may be encrypted."""
    return _MESSAGE_HEADER.pack(frame.component, frame.type) + frame.data


def seal(cipher: int, content: bytes) -> bytes:
    """Prepend the version 2 header to a payload.

    :param cipher: the number of the payload's cipher; 0 if unencrypted.
    """
    return _HEADER_V2.pack(2, cipher, len(content)) + content


def parse_payload(content: bytes) -> Frame:
    """Return the frame of a version 2 payload.

    :raises ProtobufError: if the payload is too short.
    """
    if len(content) < _MESSAGE_HEADER.size:
        raise ProtobufError("the frame is too short for a message header")
    component, type_ = _MESSAGE_HEADER.unpack_from(content)
    return Frame(component, type_, content[_MESSAGE_HEADER.size :])


def open_datagram(data: bytes, version: int = 2) -> tuple[int, bytes]:
    """Return the cipher of a datagram and its payload in version 2 layout.

    The size in the header is ignored if the payload is encrypted, as in protobuf_comm.

    :raises ProtobufError: if the datagram is not a frame.
    """
    header = _HEADER_V1 if version == 1 else _HEADER_V2
    if len(data) < header.size:
        raise ProtobufError("the datagram is too short for a frame")
    if version == 1:
        component, type_, size = _HEADER_V1.unpack_from(data)
        # version 1 has the ids in its header, version 2 in the payload, where they are encrypted, too
        content = payload(Frame(component, type_, data[header.size :]))
        cipher, size = NO_CIPHER, size + _MESSAGE_HEADER.size
    else:
        frame_version, cipher, size = _HEADER_V2.unpack_from(data)
        content = data[header.size :]
        if frame_version != version:
            raise ProtobufError(f"the datagram is not a frame of version {version}")
    if cipher == NO_CIPHER and size != len(content):
        raise ProtobufError(f"the frame reports {size} bytes and has {len(content)}")
    return cipher, content


class StreamDecoder:
    """Splits a byte stream into frames.

    :param max_size: the limit of a frame's size without its header.
    :param version: the frame version.
    """

    def __init__(self, max_size: int, version: int = 2) -> None:
        self._max_size = max_size
        self._version = version
        self._header = _HEADER_V1 if version == 1 else _HEADER_V2
        self._buffer = bytearray()

    def feed(self, data: bytes) -> Iterator[Frame]:
        """Process received bytes and yield the complete frames.

        :raises ProtobufError: if a frame has another version or an invalid size, or is encrypted. The decoder
            is then unusable.
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
        del self._buffer[:start]  # once, because each deletion moves the remaining bytes

    def _size(self, start: int) -> int:
        """Return the size in the header of the frame at an offset."""
        if self._version == 1:
            size = int(self._header.unpack_from(self._buffer, start)[2])
            minimum = 0
        else:
            version, cipher, size = self._header.unpack_from(self._buffer, start)
            minimum = _MESSAGE_HEADER.size
            if version != self._version:
                raise ProtobufError(f"the stream has no frames of version {self._version}")
            if cipher != NO_CIPHER:
                raise ProtobufError("a frame is encrypted, which streams never are")
        if not minimum <= size <= self._max_size:
            raise ProtobufError(f"a frame reports {size} bytes, {minimum} to {self._max_size} are allowed")
        return int(size)
