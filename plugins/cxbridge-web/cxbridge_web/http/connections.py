"""The connections of the web server: ended when nothing moves."""

from __future__ import annotations

import asyncio
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

PATIENCE_S: Final = 10.0
"""Seconds after which a connection on which nothing moves is ended; it may take twice as long."""


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
