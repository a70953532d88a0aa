"""The door before the server of foxglove-sdk, which answers the page of any origin: it looks at who comes.

The door reads the head of each connection's request, refuses pages of other origins and names that are not
this machine's, and joins the other connections with the server behind it.
"""

from __future__ import annotations

import asyncio
import secrets
import socket
import sys
import threading
from collections.abc import Callable, Collection, Coroutine
from contextlib import suppress
from typing import Any, Final

from cxbridge.blackboard.kit.accepting import PatientListener, Shortage, heed_shortage
from cxbridge.closing import Closing
from cxbridge.listening import LOCAL_NAMES, LOOPBACK, is_loopback, is_named, is_own_page
from cxbridge.trace.foxglove.settings import FoxgloveSettings

MOST_CONNECTIONS: Final = 64
"""Connections at a time."""

_MOST_HEAD: Final = 16_384
_HEAD_S: Final = 5.0
_STOP_S: Final = 5.0
_PIECE: Final = 1 << 16
_END: Final = b"\r\n\r\n"


def hidden_host() -> str:
    """Return an address of this machine for the server behind the door.

    Linux and Windows have 16 million of them: no page of a browser tries so many with all their ports.
    """
    if sys.platform == "darwin":  # which has only the first one
        return LOOPBACK
    parts = (1 + secrets.randbelow(254) for _ in range(3))
    return ".".join(map(str, (127, *parts)))


class FoxgloveDoor(Closing):
    """Listens where Foxglove connects, in a thread of its own.

    :param warn: gets what goes wrong.
    :raises OSError: when the address or the port cannot be had.
    """

    def __init__(
        self, settings: FoxgloveSettings, inner: tuple[str, int], warn: Callable[[str], None]
    ) -> None:
        self._inner, self._origins, self._warn = inner, settings.allow_origins, warn
        here = is_loopback(settings.host)
        self._names: Collection[str] | None = LOCAL_NAMES | {settings.host.lower()} if here else None
        family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
        self._listening = socket.create_server((settings.host, settings.port), family=family)
        self.port: int = self._listening.getsockname()[1]
        self._loop = asyncio.new_event_loop()
        self._tasks: set[asyncio.Task[None]] = set()
        self._thread = threading.Thread(target=self._work, name="foxglove door", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End all connections, and listen no more."""
        with suppress(RuntimeError):  # it has ended already
            self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(_STOP_S)

    def _work(self) -> None:
        asyncio.set_event_loop(self._loop)
        heed_shortage(self._loop, Shortage(self._warn, "Foxglove"))
        patient = PatientListener.of(self._listening)
        server = self._loop.run_until_complete(
            asyncio.start_server(self._greet, sock=patient, limit=_MOST_HEAD)
        )
        self._loop.run_forever()
        server.close()
        for task in self._tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*self._tasks, return_exceptions=True))
        self._loop.close()

    async def _greet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        try:
            with suppress(OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, TimeoutError):
                await self._admit(reader, writer)
        finally:
            self._tasks.discard(task)
            writer.close()

    async def _admit(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await asyncio.wait_for(reader.readuntil(_END), _HEAD_S)
        if refusal := self._refusal(head):
            body = refusal.partition(" ")[2]
            answer = f"HTTP/1.1 {refusal}\r\nContent-Length: {len(body)}\r\nConnection: close\r\n\r\n{body}"
            writer.write(answer.encode())
            await writer.drain()
            return
        there, back = await asyncio.open_connection(*self._inner)
        try:
            back.write(head)
            await _first_of(_pass_on(reader, back), _pass_on(there, writer))
        finally:
            back.close()

    def _refusal(self, head: bytes) -> str:
        """Return status and reason of a request that is refused; empty for one that is not."""
        if len(self._tasks) > MOST_CONNECTIONS:
            return "503 Too many connections"
        hosts, origins = _values(head, "host"), _values(head, "origin")
        if len(hosts) != 1 or len(origins) > 1:
            return "400 One Host and one Origin at most"
        if self._names is not None and not is_named(hosts[0], self._names):
            return "421 This server has no such name"
        if not is_own_page("".join(origins), "http", hosts[0], self._origins):
            return "403 Pages of other origins may not use this server"
        return ""


def _values(head: bytes, name: str) -> list[str]:
    """Return the values of a field in the head of a request."""
    fields = (line.partition(":") for line in head.decode("latin-1").split("\r\n")[1:])
    return [value.strip() for found, _, value in fields if found.strip().lower() == name]


async def _pass_on(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(_PIECE):
        writer.write(data)
        await writer.drain()


async def _first_of(*ways: Coroutine[Any, Any, None]) -> None:
    """Pass on both ways until one of them has ended."""
    tasks = [asyncio.create_task(way) for way in ways]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
