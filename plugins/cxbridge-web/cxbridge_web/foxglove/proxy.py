"""A proxy before the server of foxglove-sdk, which itself accepts pages of any origin.

It reads the head of each connection's request, rejects pages of other origins and names of other machines,
and forwards the remaining connections to the server.
"""

from __future__ import annotations

import asyncio
import secrets
import socket
import sys
from collections.abc import Collection, Coroutine
from contextlib import suppress
from typing import Any, Final

from cxbridge.blackboard.kit.event_loop import LoopThread
from cxbridge.closing import Closing
from cxbridge.listening import LOCAL_NAMES, LOOPBACK, is_loopback, is_named, is_own_page
from cxbridge_web.foxglove.settings import FoxgloveSettings

MOST_CONNECTIONS: Final = 64  # limit of simultaneous connections

_MOST_HEAD: Final = 16_384  # bytes of a request's head
_HEAD_S: Final = 5.0  # seconds for the head to arrive
_START_S: Final = 10.0  # seconds for the thread to start
_PIECE: Final = 1 << 16  # bytes forwarded at once
_END: Final = b"\r\n\r\n"


def hidden_host() -> str:
    """Return a random loopback address for the server behind the filter.

    Linux and Windows have 16 million of them, too many for a web page to try with all ports.
    """
    if sys.platform == "darwin":  # macOS has only one
        return LOOPBACK
    parts = (1 + secrets.randbelow(254) for _ in range(3))
    return ".".join(map(str, (127, *parts)))


class FoxgloveProxy(Closing):
    """Listens at Foxglove's port in a thread.

    :param server_address: host and port of the server behind the proxy.

    :raises OSError: if the address or the port is unavailable.
    """

    def __init__(self, settings: FoxgloveSettings, server_address: tuple[str, int]) -> None:
        self._server_address, self._origins = server_address, settings.allow_origins
        is_local = is_loopback(settings.host)
        self._names: Collection[str] | None = LOCAL_NAMES | {settings.host.lower()} if is_local else None
        family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
        self._connections = 0
        listening = socket.create_server((settings.host, settings.port), family=family)
        self.port: int = listening.getsockname()[1]
        self._thread = LoopThread("foxglove proxy")
        self._server = self._thread.spawn(self._serve(listening)).result(_START_S)

    def close(self) -> None:
        """Close all connections and stop listening."""
        self._thread.call(self._server.close)
        self._thread.close()

    async def _serve(self, listening: socket.socket) -> asyncio.Server:
        return await asyncio.start_server(self._accept, sock=listening, limit=_MOST_HEAD)

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._connections += 1
        try:
            with suppress(OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, TimeoutError):
                await self._forward(reader, writer)
        finally:
            self._connections -= 1
            writer.close()

    async def _forward(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await asyncio.wait_for(reader.readuntil(_END), _HEAD_S)
        if refusal := self._refusal(head):
            body = refusal.partition(" ")[2]
            response = f"HTTP/1.1 {refusal}\r\nContent-Length: {len(body)}\r\nConnection: close\r\n\r\n{body}"
            writer.write(response.encode())
            await writer.drain()
            return
        server_reader, server_writer = await asyncio.open_connection(*self._server_address)
        try:
            server_writer.write(head)
            await _until_first_ends(_copy_bytes(reader, server_writer), _copy_bytes(server_reader, writer))
        finally:
            server_writer.close()

    def _refusal(self, head: bytes) -> str:
        """Return status and reason of a rejection; empty for an accepted request."""
        if self._connections > MOST_CONNECTIONS:
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
    """Return the values of a header field in the head of a request."""
    fields = (line.partition(":") for line in head.decode("latin-1").split("\r\n")[1:])
    return [value.strip() for field, _, value in fields if field.strip().lower() == name]


async def _copy_bytes(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(_PIECE):
        writer.write(data)
        await writer.drain()


async def _until_first_ends(*directions: Coroutine[Any, Any, None]) -> None:
    """Run both forwarding directions until one of them ends."""
    tasks = [asyncio.create_task(direction) for direction in directions]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
