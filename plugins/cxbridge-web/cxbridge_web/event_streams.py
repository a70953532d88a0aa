"""A stream of events for each client that wants one, as server-sent events."""

from __future__ import annotations

import asyncio
import json
import re
import secrets
from typing import TYPE_CHECKING, Final

from starlette.requests import Request
from starlette.responses import PlainTextResponse

from cxbridge.event_kinds import EVENT_TYPES
from cxbridge_web.endpoint import to_json
from cxbridge_web.event_buffer import GROUPS, EventBuffer, EventSelection, StreamPosition
from cxbridge_web.event_collector import EventCollector, default_kinds

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

    from cxbridge_web.host import WebHost

PERIOD_S: Final = 0.05
"""Seconds between bunches."""

ALIVE_S: Final = 15.0
"""Seconds without events after which a comment is sent."""

MOST_CLIENTS: Final = 100
"""Who may follow at the same time."""

_ID: Final = re.compile(r"([^-]*)-" + r"\.".join([r"(\d{1,19})"] * (len(GROUPS) + 2)), re.ASCII)
_HEADERS: Final = [(b"content-type", b"text/event-stream"), (b"cache-control", b"no-store")]


class EventStreams:
    """Sends events to clients. An ASGI application; lives in the thread of the server.

    :param collector: where the events come from.
    :param alive_s: see :data:`ALIVE_S`.
    """

    def __init__(
        self,
        host: WebHost,
        collector: EventCollector,
        buffer: EventBuffer | None = None,
        alive_s: float = ALIVE_S,
    ) -> None:
        self._host = host
        self._collector = collector
        self._buffer = EventBuffer() if buffer is None else buffer
        self._alive_s = alive_s
        self._epoch = secrets.token_hex(4)
        self._news = asyncio.Event()
        self._ticker: asyncio.Task[None] | None = None
        self._closed = False
        self._bunches: dict[tuple[StreamPosition, EventSelection, bool], tuple[bytes, StreamPosition]] = {}
        self.clients = 0
        """How many follow now."""
        self.dropped = 0
        """Events that clients were too slow for, all together."""

    @property
    def count(self) -> int:
        """How many events there were."""
        return self._buffer.count

    def close(self) -> None:
        """End all streams; in the thread of the server."""
        self._closed = True
        self._tick()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one client until it goes."""
        request = Request(scope, receive)
        try:
            selection = _selection(request)
            self._collect()
            position = self._position(request)
        except ValueError as error:
            await PlainTextResponse(str(error), 400)(scope, receive, send)
            return
        if self.clients >= MOST_CLIENTS:
            await PlainTextResponse("Too many clients follow already", 503)(scope, receive, send)
            return
        self.clients += 1
        self._collector.want(selection.kinds, more=True)
        if self._ticker is None:
            self._ticker = asyncio.create_task(self._poll_events())
        gone = asyncio.create_task(_disconnected(receive))
        together = request.query_params.get("together") == "true"
        following = asyncio.create_task(self._follow(send, selection, position, together=together))
        try:
            await asyncio.wait((gone, following), return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (gone, following):
                task.cancel()
            await asyncio.gather(gone, following, return_exceptions=True)
            self._collector.want(selection.kinds, more=False)
            self.clients -= 1
            if "interface" in selection.kinds:
                self._buffer.forget_interfaces()

    def _position(self, request: Request) -> StreamPosition:
        """Return the position after which the client wants to continue.

        :raises ValueError: when it is not an id.
        """
        text = request.headers.get("last-event-id") or request.query_params.get("since")
        if text is None:
            return self._buffer.end
        if text == "0":
            return self._buffer.begin
        found = _ID.fullmatch(text)
        if found is None:
            raise ValueError(f"'{text[:40]}' is not an id of an event")
        epoch, *counts = found.groups()
        if epoch != self._epoch:  # one of a server before: all that is kept is new
            return self._buffer.begin
        end = self._buffer.end
        *known, lost = map(min, map(int, counts), (*end.counts, end.lost))
        return StreamPosition(tuple(known), lost)

    async def _follow(
        self, send: Send, selection: EventSelection, position: StreamPosition, *, together: bool
    ) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": _HEADERS})
        hello = to_json(
            {"kind": "hello", "time_us": self._host.bus.clock.now_us(), "last": self._id(position)}
        )
        await _send(send, b"retry: 2000\nevent: hello\ndata: " + hello + b"\n\n")
        while not self._closed:
            text, position = self._bunch(position, selection, together=together)
            if text:
                await _send(send, text)
            if position == self._buffer.end:
                await self._wait(send)
        await send({"type": "http.response.body", "body": b"", "more_body": False})

    async def _wait(self, send: Send) -> None:
        """Wait for news, and send a sign of life now and then."""
        news = self._news
        while not self._closed:
            try:
                await asyncio.wait_for(news.wait(), self._alive_s)
            except TimeoutError:
                await _send(send, b": alive\n\n")
            else:
                return

    def _bunch(
        self, position: StreamPosition, selection: EventSelection, *, together: bool
    ) -> tuple[bytes, StreamPosition]:
        """Return the events after a position as text, and the position after them; made once for all clients.

        :param together: as one message, whose lines are the events: browsers take a tenth of a millisecond
            for each message.
        """
        key = (position, selection, together)
        bunch = self._bunches.get(key)
        if bunch is None:
            found, upto, gone = self._buffer.after(position, selection)
            parts = []
            if gone:
                dropped = json.dumps({"kind": "dropped", "count": gone})
                parts.append(f"event: dropped\ndata: {dropped}\n\n".encode())
                self.dropped += gone
            messages = [found] if together and found else [[each] for each in found]
            parts += [self._message(each) for each in messages]
            bunch = self._bunches[key] = (b"".join(parts), upto)
        return bunch

    def _message(self, events: list[tuple[StreamPosition, bytes]]) -> bytes:
        """Return a message with events, one a line."""
        after, _ = events[-1]
        lines = b"\n".join(b"data: " + text for _, text in events)
        return b"id: %s\n%s\n\n" % (self._id(after).encode(), lines)

    def _id(self, position: StreamPosition) -> str:
        return f"{self._epoch}-{position}"

    async def _poll_events(self) -> None:
        """Look for events as long as there are clients."""
        while self.clients and not self._closed:
            if self._collect():
                self._tick()
            await asyncio.sleep(PERIOD_S)
        self._ticker = None

    def _collect(self) -> bool:
        """Take over new events; return whether there are any."""
        before = self._buffer.end
        events, lost = self._collector.drain()
        if lost:
            self._buffer.skip(lost)
        if events:
            self._buffer.add(events)
        if self._buffer.end == before:
            return False
        self._bunches.clear()
        return True

    def _tick(self) -> None:
        news, self._news = self._news, asyncio.Event()
        news.set()


async def _send(send: Send, text: bytes) -> None:
    await send({"type": "http.response.body", "body": text, "more_body": True})


async def _disconnected(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass


def _selection(request: Request) -> EventSelection:
    """Return the client's selection.

    :raises ValueError: when there is no such kind.
    """
    text = request.query_params.get("kinds", "")
    kinds = frozenset(kind.strip() for kind in text.split(",") if kind.strip())
    if unknown := kinds - EVENT_TYPES.keys():
        raise ValueError(f"There is no kind '{min(unknown)}'; there are: {', '.join(EVENT_TYPES)}")
    return EventSelection(kinds or default_kinds(), request.query_params.get("env", ""))
