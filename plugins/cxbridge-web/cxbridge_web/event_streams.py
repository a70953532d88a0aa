"""Server-sent events: a stream for each client.

The id of an event is its position in the stream. A browser that reconnects sends the last id, and continues
after that event.
"""

from __future__ import annotations

import asyncio
import json
import re
import secrets
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, Final

from starlette.requests import Request
from starlette.responses import PlainTextResponse, StreamingResponse

from cxbridge.event_kinds import EVENT_TYPES
from cxbridge_web.event_buffer import GROUPS, EventBuffer, StreamPosition
from cxbridge_web.event_collector import EventCollector, list_default_kinds
from cxbridge_web.models import to_json

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

    from cxbridge_web.host import WebHost

POLL_PERIOD_S: Final = 0.05  # time between two bunches of events

KEEP_ALIVE_S: Final = 15.0  # time without events after which the server sends a comment

_RETRY_MS: Final = 2000  # time after which a browser reconnects

MAX_CLIENTS: Final = 100  # number of simultaneous clients

# The id of an event: `EPOCH-COUNT.COUNT.COUNT.LOST`, a StreamPosition with the count of each group in GROUPS,
# and of the group of all other kinds. The largest 64-bit integer has 19 digits.
_EVENT_ID: Final = re.compile(r"([^-]*)-" + r"\.".join([r"(\d{1,19})"] * (len(GROUPS) + 2)), re.ASCII)
_HEADERS: Final = {"content-type": "text/event-stream", "cache-control": "no-store"}


class EventStreams:
    """Sends events to clients; an ASGI application in the server's thread.

    :param collector: the source of the events.
    """

    def __init__(
        self,
        host: WebHost,
        collector: EventCollector,
        buffer: EventBuffer | None = None,
    ) -> None:
        self._host = host
        self._collector = collector
        self._buffer = EventBuffer() if buffer is None else buffer
        self._epoch = secrets.token_hex(4)  # tells ids of an earlier server process apart
        self._new_events = asyncio.Event()
        self._poller: asyncio.Task[None] | None = None
        self._is_closed = False
        self.client_count = 0  # number of connected clients

    def close(self) -> None:
        """End all streams; called in the server's thread."""
        self._is_closed = True
        self._wake_clients()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one client until it disconnects."""
        request = Request(scope, receive)
        try:
            kinds = _parse_kinds(request)
            self._collect_events()
            position = self._parse_position(request)
        except ValueError as error:
            await PlainTextResponse(str(error), 400)(scope, receive, send)
            return
        if self.client_count >= MAX_CLIENTS:
            await PlainTextResponse("Too many clients are following the events already", 503)(
                scope, receive, send
            )
            return
        self.client_count += 1
        self._collector.change_requests(kinds, add=True)
        if self._poller is None:
            self._poller = asyncio.create_task(self._poll_events())
        is_joined = request.query_params.get("together") == "true"
        stream = self._make_stream(kinds, position, is_joined=is_joined)
        try:
            await StreamingResponse(stream, headers=_HEADERS)(scope, receive, send)
        finally:
            self._collector.change_requests(kinds, add=False)
            self.client_count -= 1
            if "interface" in kinds:  # the next client must get all values, even unchanged values
                self._buffer.forget_interfaces()

    def _parse_position(self, request: Request) -> StreamPosition:
        """Return the position from which the client continues.

        :raises ValueError: if the id is invalid.
        """
        # the header first: a browser that reconnects repeats the query of its first request
        event_id = request.headers.get("last-event-id") or request.query_params.get("since")
        if event_id is None:
            return self._buffer.end
        if event_id == "0":
            return self._buffer.begin
        match = _EVENT_ID.fullmatch(event_id)
        if match is None:
            raise ValueError(f"'{event_id[:40]}' is not the id of an event")
        epoch, *counts = match.groups()
        if epoch != self._epoch:  # an id of an earlier server process: send all buffered events
            return self._buffer.begin
        end = self._buffer.end
        # a position beyond the end, which a faulty client may send, would hide all further events
        *group_counts, lost_count = map(min, map(int, counts), (*end.counts, end.lost))
        return StreamPosition(tuple(group_counts), lost_count)

    async def _make_stream(
        self, kinds: frozenset[str], position: StreamPosition, *, is_joined: bool
    ) -> AsyncIterator[bytes]:
        """Yield a message ``hello``, and events from a position on, until the streams are closed.

        Comments in between show that the connection is alive.
        """
        hello = to_json(
            {"kind": "hello", "time_us": self._host.bus.clock.now_us(), "last": self._encode_id(position)}
        )
        yield b"retry: %d\nevent: hello\ndata: %s\n\n" % (_RETRY_MS, hello)
        while not self._is_closed:
            text, position = self._encode_bunch(position, kinds, is_joined=is_joined)
            if text:
                yield text
            if position == self._buffer.end and not self._is_closed:
                try:
                    await asyncio.wait_for(self._new_events.wait(), KEEP_ALIVE_S)
                except TimeoutError:
                    yield b": alive\n\n"

    def _encode_bunch(
        self, position: StreamPosition, kinds: frozenset[str], *, is_joined: bool
    ) -> tuple[bytes, StreamPosition]:
        """Return the encoded events after a position, perhaps none, and the position after the events.

        :param is_joined: whether to send one message with an event per line, since browsers need 0.1 ms per
            message.
        """
        buffered_events, end_position, missing_count = self._buffer.read_bunch_after(position, kinds)
        dropped_notice = b""
        if missing_count:
            dropped_message = json.dumps({"kind": "dropped", "count": missing_count})
            dropped_notice = f"event: dropped\ndata: {dropped_message}\n\n".encode()
        messages = [buffered_events] if is_joined else [[event] for event in buffered_events]
        encoded_messages = b"".join(self._encode_message(message) for message in messages if message)
        return dropped_notice + encoded_messages, end_position

    def _encode_message(self, events: list[tuple[StreamPosition, bytes]]) -> bytes:
        """Return a message with one event per line, and the position after the last event as its id."""
        position, _ = events[-1]
        lines = b"\n".join(b"data: " + text for _, text in events)
        return b"id: %s\n%s\n\n" % (self._encode_id(position).encode(), lines)

    def _encode_id(self, position: StreamPosition) -> str:
        return f"{self._epoch}-{position}"

    async def _poll_events(self) -> None:
        """Poll for events while clients are connected."""
        while self.client_count and not self._is_closed:
            if self._collect_events():
                self._wake_clients()
            await asyncio.sleep(POLL_PERIOD_S)
        self._poller = None

    def _collect_events(self) -> bool:
        """Buffer further events; return whether there were any, or any were lost."""
        previous_end = self._buffer.end
        events, lost_count = self._collector.take_events()
        if lost_count:
            self._buffer.count_lost(lost_count)
        if events:
            self._buffer.add(events)
        return self._buffer.end != previous_end

    def _wake_clients(self) -> None:
        """Wake all waiting clients; from now on, clients wait for a new event of asyncio."""
        previous_event, self._new_events = self._new_events, asyncio.Event()
        previous_event.set()


def _parse_kinds(request: Request) -> frozenset[str]:
    """Return the kinds of events that the client requests.

    :raises ValueError: if a kind is unknown.
    """
    kinds_text = request.query_params.get("kinds", "")
    kinds = frozenset(kind.strip() for kind in kinds_text.split(",") if kind.strip())
    if unknown_kinds := kinds - EVENT_TYPES.keys():
        raise ValueError(
            f"The kind '{min(unknown_kinds)}' is unknown; the known kinds are: {', '.join(EVENT_TYPES)}"
        )
    return kinds or list_default_kinds()
