"""Encodes and decodes frames: a frame carries a protobuf message with the numbers of its type.

docs/evidence/protocol-protobuf.md describes the frames of protobuf_comm.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cxbridge.errors import ProtobufError

# The header: version, cipher, two unused bytes, size. The payload starts with the message header, which has
# component id and message type.
_HEADER: Final = struct.Struct("!BBxxI")
_MESSAGE_HEADER: Final = struct.Struct("!HH")
_VERSION: Final = 2  # version 1 was in use before 2014

NO_CIPHER: Final = 0  # the cipher number of an unencrypted frame


@dataclass(frozen=True, slots=True)
class Frame:
    """An encoded message with the numbers of its type.

    :param component: the component id, 0 to 65535.
    :param type: the number of the message type, 0 to 65535.
    """

    component: int
    type: int
    encoded_message: bytes


def encode_frame(frame: Frame) -> bytes:
    """Return an unencrypted frame with its header."""
    return add_header(NO_CIPHER, encode_payload(frame))


def encode_payload(frame: Frame) -> bytes:
    """Return the payload of a frame: the part that may be encrypted."""
    return _MESSAGE_HEADER.pack(frame.component, frame.type) + frame.encoded_message


def add_header(cipher_number: int, payload: bytes) -> bytes:
    """Prepend the header to a payload.

    :param cipher_number: the number of the payload's cipher; 0 if unencrypted.
    """
    return _HEADER.pack(_VERSION, cipher_number, len(payload)) + payload


def decode_payload(payload: bytes) -> Frame:
    """Return the frame of a payload.

    :raises ProtobufError: if the payload is too short.
    """
    if len(payload) < _MESSAGE_HEADER.size:
        raise ProtobufError("the frame is too short for a message header")
    component, type_ = _MESSAGE_HEADER.unpack_from(payload)
    return Frame(component, type_, payload[_MESSAGE_HEADER.size :])


def decode_datagram(datagram: bytes) -> tuple[int, bytes]:
    """Return the cipher number of a datagram, and the payload, which is still encrypted if there is a cipher.

    As in protobuf_comm, the size in the header is ignored if the payload is encrypted.

    :raises ProtobufError: if the datagram is not a frame.
    """
    if len(datagram) < _HEADER.size:
        raise ProtobufError("the datagram is too short for a frame")
    version, cipher_number, size = _HEADER.unpack_from(datagram)
    payload = datagram[_HEADER.size :]
    if version != _VERSION:
        raise ProtobufError(f"the datagram is not a frame of version {_VERSION}")
    if cipher_number == NO_CIPHER and size != len(payload):
        raise ProtobufError(f"the frame reports {size} bytes and has {len(payload)}")
    return cipher_number, payload


class StreamDecoder:
    """Splits a byte stream into frames.

    :param max_payload_bytes: the limit of a frame's size without its header.
    """

    def __init__(self, max_payload_bytes: int) -> None:
        self._max_payload_bytes = max_payload_bytes
        self._buffer = bytearray()

    def feed(self, received_bytes: bytes) -> Iterator[Frame]:
        """Add received bytes, and yield the complete frames. The caller must consume all frames.

        :raises ProtobufError: if a frame has another version or an invalid size, or is encrypted; then the
            decoder is unusable.
        """
        self._buffer += received_bytes
        start = 0
        while len(self._buffer) - start >= _HEADER.size:
            end = start + _HEADER.size + self._read_size(start)
            if len(self._buffer) < end:
                break
            yield decode_payload(bytes(self._buffer[start + _HEADER.size : end]))
            start = end
        del self._buffer[:start]  # only once, since a deletion moves all remaining bytes

    def _read_size(self, start: int) -> int:
        """Return the size in the header of the frame at an offset.

        :raises ProtobufError: as in :meth:`feed`.
        """
        version, cipher_number, size = _HEADER.unpack_from(self._buffer, start)
        if version != _VERSION:
            raise ProtobufError(f"the stream has no frames of version {_VERSION}")
        if cipher_number != NO_CIPHER:
            raise ProtobufError("a frame is encrypted, which streams never are")
        if not _MESSAGE_HEADER.size <= size <= self._max_payload_bytes:
            raise ProtobufError(
                f"a frame reports {size} bytes, "
                f"but must have {_MESSAGE_HEADER.size} to {self._max_payload_bytes}"
            )
        return int(size)
