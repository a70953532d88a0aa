"""The connections of the web server: ended when nothing moves, limited in number."""

from __future__ import annotations

import asyncio
import socket
import weakref
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

from cxbridge.blackboard.kit.accepting import PatientListener

PATIENCE_S: Final = 10.0
"""Seconds after which a connection on which nothing moves is ended; it may take twice as long."""

MOST_SOCKETS: Final = 256
"""Connections that are taken at all, those that are still at TLS' handshake included."""


class Connection(H11Protocol):
    """A connection that is ended when its client neither completes a request nor reads the answer.

    Streams without news stay: there the server is the one that has nothing to say.
    """

    patience_s: float = PATIENCE_S

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
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
    """A listening socket that keeps at most :data:`MOST_SOCKETS` connections, and ends further ones.

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
