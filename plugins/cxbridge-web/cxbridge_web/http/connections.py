"""Connections of the web server with a limit on idle time."""

from __future__ import annotations

import asyncio
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

# The period of checks for progress: an idle connection is closed after one to two periods, 10 to 20 s, as
# docs/rest.md says.
IDLE_LIMIT_S: Final = 10.0


class IdleLimitedConnection(H11Protocol):
    """A connection that is closed if its client neither sends the head of a request nor reads the response.

    JSON bodies have their own time limit (:func:`~cxbridge_web.api.read_json_object`). Idle event streams
    stay open, since their clients wait for the server.
    """

    idle_limit_s: float = IDLE_LIMIT_S

    def __init__(self, *arguments: Any, **kwargs: Any) -> None:
        super().__init__(*arguments, **kwargs)
        self._timer: asyncio.TimerHandle | None = None
        # The request and the number of unsent bytes at the last check; None if the server had to act.
        self._last_progress: tuple[object, int] | None = None

    # asyncio declares the base class BaseTransport; uvicorn narrows the type, too
    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._timer = self.loop.call_later(self.idle_limit_s, self._check_progress)

    def connection_lost(self, exc: Exception | None) -> None:
        if self._timer is not None:
            self._timer.cancel()
        super().connection_lost(exc)

    def _check_progress(self) -> None:
        """Close the connection if its client had to act since the last check and did not."""
        cycle = self.cycle
        must_client_act = cycle is None or cycle.response_complete or self.flow.write_paused
        progress = (cycle, self.transport.get_write_buffer_size()) if must_client_act else None
        if progress is not None and progress == self._last_progress:
            self.transport.abort()
            return
        self._last_progress = progress
        self._timer = self.loop.call_later(self.idle_limit_s, self._check_progress)
