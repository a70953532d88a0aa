"""The transport of the Debug Adapter Protocol over byte streams: a header with the length, then JSON."""

from __future__ import annotations

import re
import threading
from io import RawIOBase
from typing import BinaryIO, Final

import msgspec

from cxbridge.errors import CxbridgeError
from cxbridge_studio.dap.protocol import Event, Request, Response

# limits of a client's messages, so that a faulty client cannot exhaust the memory
MAX_MESSAGE_BYTES: Final = 16 * 1024 * 1024
_MAX_HEADERS: Final = 32
_MAX_LINE_BYTES: Final = 4096
_LENGTH_HEADER: Final = re.compile(
    rb"^Content-Length[ \t]*:[ \t]*(\d{1,9})[ \t]*\r?$", re.IGNORECASE | re.MULTILINE
)


class WireError(CxbridgeError):
    """The error about received bytes that are not a message of the protocol."""


class Wire:
    """Reads requests from one stream, and writes responses and events to another.

    One thread reads. Any thread may write.

    :param source: the stream of the client's messages. An unbuffered stream is better: a thread that waits in
        a buffered stream holds the stream's lock, at which Python's exit would wait.
    """

    def __init__(self, source: RawIOBase | BinaryIO, sink: BinaryIO) -> None:
        self._source = source
        self._sink = sink
        self._lock = threading.Lock()
        self._last_number = 0
        self._encoder = msgspec.json.Encoder()
        self._decoder = msgspec.json.Decoder(Request)

    def read(self) -> Request | None:
        """Return the next request; None at the end of the stream.

        :raises WireError: if the bytes are not a request.
        """
        length = self._read_length()
        if length is None:
            return None
        body = self._read_exactly(length)
        if body is None:
            return None
        try:
            return self._decoder.decode(body)
        except msgspec.DecodeError as error:
            raise WireError(f"this is not a request of the debug adapter protocol: {error}") from error

    def _read_exactly(self, length: int) -> bytes | None:
        """Return the next ``length`` bytes; None if the stream ends earlier."""
        chunks: list[bytes] = []
        while length > 0:
            chunk = self._source.read(length)
            if not chunk:
                return None
            chunks.append(chunk)
            length -= len(chunk)
        return b"".join(chunks)

    def _read_length(self) -> int | None:
        """Read a header, and return the length of the message; None at the end of the stream.

        :raises WireError: if the header is too long, or its length is missing or too large.
        """
        lines: list[bytes] = []
        while (line := self._source.readline(_MAX_LINE_BYTES)).strip():
            lines.append(line)
            if len(lines) > _MAX_HEADERS:
                raise WireError(f"a message has more than {_MAX_HEADERS} lines of headers")
        if not line:
            return None
        match = _LENGTH_HEADER.search(b"".join(lines))
        if match is None or int(match[1]) > MAX_MESSAGE_BYTES:
            raise WireError(f"a message has no Content-Length that is a number up to {MAX_MESSAGE_BYTES}")
        return int(match[1])

    def write(self, message: Response | Event) -> None:
        """Send a message with the next sequence number; do nothing if the client has closed the stream."""
        with self._lock:
            self._last_number += 1
            message.seq = self._last_number
            body = self._encoder.encode(message)
            try:
                self._sink.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
                self._sink.flush()
            except (BrokenPipeError, ValueError):  # ValueError: the sink is closed
                pass  # the end of the source stream ends the session
