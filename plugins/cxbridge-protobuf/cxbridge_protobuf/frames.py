"""Encodes and decodes frames: a frame carries a protobuf message with the numbers of its type.

docs/evidence/protocol-protobuf.md describes the two versions of frames that protobuf_comm has.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cxbridge.errors import ProtobufError

# The header of version 1: component id, message type, size. The header of version 2: version, cipher, two
# unused bytes, size; there the payload starts with the message header, which has component id and message
# type.
_HEADER_V1: Final = struct.Struct("!HHI")
_HEADER_V2: Final = struct.Struct("!BBxxI")
_MESSAGE_HEADER: Final = struct.Struct("!HH")

VERSIONS: Final = (1, 2)  # the versions of frames that protobuf_comm has

NO_CIPHER: Final = 0  # the cipher number of an unencrypted frame


@dataclass(frozen=True, slots=True)
class Frame:
    """An encoded message with the numbers of its type.

    :param component: the component id, 0 to 65535.
    :param type: the number of the message type, 0 to 65535.
    :param data: the encoded message.
    """

    component: int
    type: int
    data: bytes


def encode_frame(frame: Frame, version: int = 2) -> bytes:
    if version == 1:
        return _HEADER_V1.pack(frame.component, frame.type, len(frame.data)) + frame.data
    return add_header(NO_CIPHER, encode_payload(frame))


def encode_payload(frame: Frame) -> bytes:
    """Return the payload of a version 2 frame: the part that may be encrypted."""
    return _MESSAGE_HEADER.pack(frame.component, frame.type) + frame.data


def add_header(cipher_number: int, payload: bytes) -> bytes:
    """Prepend the version 2 header to a payload.

    :param cipher_number: the number of the payload's cipher; 0 if unencrypted.
    """
    return _HEADER_V2.pack(2, cipher_number, len(payload)) + payload


def decode_payload(payload: bytes) -> Frame:
    """Return the frame of a version 2 payload.

    :raises ProtobufError: if the payload is too short.
    """
    if len(payload) < _MESSAGE_HEADER.size:
        raise ProtobufError("the frame is too short for a message header")
    component, type_ = _MESSAGE_HEADER.unpack_from(payload)
    return Frame(component, type_, payload[_MESSAGE_HEADER.size :])


def decode_datagram(data: bytes, version: int = 2) -> tuple[int, bytes]:
    """Return the cipher number of a datagram, and its payload in the layout of version 2.

    As in protobuf_comm, the size in the header is ignored if the payload is encrypted.

    :raises ProtobufError: if the datagram is not a frame.
    """
    header = _HEADER_V1 if version == 1 else _HEADER_V2
    if len(data) < header.size:
        raise ProtobufError("the datagram is too short for a frame")
    if version == 1:
        component, type_, size = _HEADER_V1.unpack_from(data)
        payload = encode_payload(Frame(component, type_, data[header.size :]))
        cipher_number, size = NO_CIPHER, size + _MESSAGE_HEADER.size
    else:
        frame_version, cipher_number, size = _HEADER_V2.unpack_from(data)
        payload = data[header.size :]
        if frame_version != version:
            raise ProtobufError(f"the datagram is not a frame of version {version}")
    if cipher_number == NO_CIPHER and size != len(payload):
        raise ProtobufError(f"the frame reports {size} bytes and has {len(payload)}")
    return cipher_number, payload


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
        """Add received bytes, and yield the complete frames.

        :raises ProtobufError: if a frame has another version or an invalid size, or is encrypted; then the
            decoder is unusable.
        """
        self._buffer += data
        start, header = 0, self._header
        while len(self._buffer) - start >= header.size:
            end = start + header.size + self._read_size(start)
            if len(self._buffer) < end:
                break
            payload = bytes(self._buffer[start + header.size : end])
            if self._version == 1:
                component, type_, _ = header.unpack_from(self._buffer, start)
                yield Frame(component, type_, payload)
            else:
                yield decode_payload(payload)
            start = end
        del self._buffer[:start]  # only once, since a deletion moves all remaining bytes

    def _read_size(self, start: int) -> int:
        """Return the size in the header of the frame at an offset."""
        if self._version == 1:
            size = int(self._header.unpack_from(self._buffer, start)[2])
            minimum = 0
        else:
            version, cipher_number, size = self._header.unpack_from(self._buffer, start)
            minimum = _MESSAGE_HEADER.size
            if version != self._version:
                raise ProtobufError(f"the stream has no frames of version {self._version}")
            if cipher_number != NO_CIPHER:
                raise ProtobufError("a frame is encrypted, which streams never are")
        if not minimum <= size <= self._max_size:
            raise ProtobufError(f"a frame reports {size} bytes, but must have {minimum} to {self._max_size}")
        return int(size)
