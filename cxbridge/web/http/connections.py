"""The connections of the web server: framed strictly, ended when nothing moves, only so many at a time."""

from __future__ import annotations

import asyncio
import re
import socket
import weakref
from typing import Any, Final

import h11
from h11._receivebuffer import ReceiveBuffer  # it offers no other place to see the lines as they came
from uvicorn.protocols.http.h11_impl import H11Protocol

from cxbridge.blackboard.kit.accepting import PatientListener

PATIENCE_S: Final = 10.0
"""Seconds after which a connection on which nothing moves is ended; it may take twice as long."""

MOST_SOCKETS: Final = 256
"""Connections that are taken at all, those that are still at TLS' handshake included."""

_LENGTH: Final = b"content-length"
_CODING: Final = b"transfer-encoding"
_BARE: Final = re.compile(rb"(?<!\r)\n|\r(?!\n)|\0")
_HEAD_END: Final = re.compile(rb"\n\r?\n")


class StrictBuffer(ReceiveBuffer):
    """The bytes of a connection: requests whose length could be read in two ways are refused.

    A proxy in front may see one request where a lenient server sees two: the second one then comes in the
    name of somebody else (request smuggling). h11 takes some of what RFC 9112 lets a server refuse; here
    all of it is refused, before h11 interprets it: both lengths at once (section 6.1), a length given
    twice, a transfer coding of HTTP/1.0, lines that end without CR (2.2), folded lines (5.2), and control
    characters in the extension of a chunk (7.1.1).
    """

    def maybe_extract_lines(self) -> list[bytearray] | None:
        """Return the lines up to a blank one; those of a request, or the trailers of its body.

        :raises h11.LocalProtocolError: when they can be read in two ways.
        """
        end = _HEAD_END.search(self._data)
        if end is not None and _BARE.search(self._data, 0, end.end()):
            raise _refused("a line ends without CR LF")
        lines = super().maybe_extract_lines()
        if lines:
            _check(lines)
        return lines

    def maybe_extract_next_line(self) -> bytearray | None:
        """Return the line that says how long a chunk is.

        :raises h11.LocalProtocolError: when it can be read in two ways.
        """
        line = super().maybe_extract_next_line()
        if line is not None and _BARE.search(line):
            raise _refused("the extension of a chunk has control characters")
        return line


def _check(lines: list[bytearray]) -> None:
    """Refuse headers that give the length in two ways.

    :raises h11.LocalProtocolError: when they do.
    """
    if any(line[:1] in b" \t" for line in lines if line):
        raise _refused("a header is folded")
    headers = [
        (name.strip().lower(), value)
        for name, colon, value in (line.partition(b":") for line in lines)
        if colon
    ]
    lengths = [value for name, value in headers if name == _LENGTH]
    codings = [value for name, value in headers if name == _CODING]
    if len(lengths) + len(codings) > 1 or any(b"," in value for value in lengths):
        raise _refused("it gives its length twice")
    if codings and lines[0].endswith(b"HTTP/1.0"):
        raise _refused("HTTP/1.0 has no transfer codings")


def _refused(why: str) -> h11.LocalProtocolError:
    return h11.LocalProtocolError(why)


class Connection(H11Protocol):
    """A connection that is ended when its client neither completes a request nor reads the answer.

    Streams without news stay: there the server is the one that has nothing to say.
    """

    patience_s: float = PATIENCE_S

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.conn._receive_buffer = StrictBuffer()  # noqa: SLF001 - see there
        self._timer: asyncio.TimerHandle | None = None
        self._mark: tuple[object, int] | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to look after it."""
        super().connection_made(transport)
        self._timer = self.loop.call_later(self.patience_s, self._look)

    def connection_lost(self, exc: Exception | None) -> None:
        """Look no more."""
        if self._timer is not None:
            self._timer.cancel()
        super().connection_lost(exc)

    def _look(self) -> None:
        """End it if its client was to act, and has not since the last look."""
        cycle = self.cycle
        to_act = cycle is None or cycle.response_complete or self.flow.write_paused
        mark = (cycle, self.transport.get_write_buffer_size()) if to_act else None
        if mark is not None and mark == self._mark:
            self.transport.abort()
            return
        self._mark = mark
        self._timer = self.loop.call_later(self.patience_s, self._look)


class Door(PatientListener):
    """A listening socket that takes at most :data:`MOST_SOCKETS` connections at a time, and ends the others.

    Without it strangers could use up the files that the process may open.
    """

    most: int = MOST_SOCKETS

    def __init__(self, family: int, kind: int) -> None:
        super().__init__(family, kind)
        self._inside: weakref.WeakSet[socket.socket] = weakref.WeakSet()

    def accept(self) -> tuple[socket.socket, Any]:
        """Take a connection.

        :raises ConnectionAbortedError: when there are too many.
        """
        connection, address = super().accept()
        if sum(inside.fileno() >= 0 for inside in self._inside) >= self.most:
            connection.close()
            raise ConnectionAbortedError
        self._inside.add(connection)
        return connection, address
