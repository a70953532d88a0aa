"""A proxy in front of the server of foxglove-sdk, which itself accepts pages of any origin.

The proxy reads the head of the request of each connection, rejects pages of other origins and names of other
machines, and forwards the remaining connections to the server.
"""

from __future__ import annotations

import asyncio
import secrets
import socket
import sys
from collections.abc import Collection
from contextlib import suppress
from typing import Final

from cxbridge.blackboard.kit.event_loop import LoopThread
from cxbridge.closing import Closing
from cxbridge.listening import LOOPBACK, is_loopback
from cxbridge_web.foxglove.settings import FoxgloveSettings
from cxbridge_web.origins import LOCAL_NAMES, has_host_name, is_permitted_request

# The limits on connections, heads and times are far above the needs of Foxglove.
MAX_CONNECTIONS: Final = 64  # number of simultaneous connections

_MAX_HEAD_BYTES: Final = 16_384  # size of the head of a request
_HEAD_TIMEOUT_S: Final = 5.0  # time limit for receiving the head
_START_TIMEOUT_S: Final = 10.0  # time limit for the start of the server in the thread
_MAX_PIECE_BYTES: Final = 1 << 16  # number of bytes that are forwarded at once
_HEAD_END: Final = b"\r\n\r\n"


def choose_hidden_host() -> str:
    """Return a random loopback address for the server behind the proxy.

    Linux and Windows have 16 million loopback addresses, too many for a web page to try with all ports.
    """
    if sys.platform == "darwin":  # macOS has only one loopback address
        return LOOPBACK
    octets = (1 + secrets.randbelow(254) for _ in range(3))  # without 0 and 255: network and broadcast
    return ".".join(map(str, (127, *octets)))


class FoxgloveProxy(Closing):
    """Listens on Foxglove's port in a thread.

    :param server_address: the host and the port of the server behind the proxy.
    :raises OSError: if the address or the port is unavailable, or the proxy does not start in time.
    """

    def __init__(self, settings: FoxgloveSettings, server_address: tuple[str, int]) -> None:
        self._server_address, self._allowed_origins = server_address, settings.allow_origins
        is_local = is_loopback(settings.host)
        # clients of a public server use names of the machine that the settings do not have
        self._allowed_host_names: Collection[str] | None = (
            LOCAL_NAMES | {settings.host.lower()} if is_local else None
        )
        family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
        self._connection_count = 0
        listening_socket = socket.create_server((settings.host, settings.port), family=family)
        # accepted sockets inherit the option; Nagle's algorithm would delay messages by up to 40 ms
        listening_socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.port: int = listening_socket.getsockname()[1]
        self._thread = LoopThread("foxglove proxy")
        start_coroutine = asyncio.start_server(self._accept, sock=listening_socket, limit=_MAX_HEAD_BYTES)
        self._server = self._thread.spawn(start_coroutine).result(_START_TIMEOUT_S)

    def close(self) -> None:
        """Close all connections and stop listening."""
        self._thread.call(self._server.close)
        self._thread.close()

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._connection_count += 1
        try:
            # a client may disconnect at any time, or send a head that is too long, or too late
            with suppress(OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, TimeoutError):
                await self._forward(reader, writer)
        finally:
            self._connection_count -= 1
            writer.close()

    async def _forward(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await asyncio.wait_for(reader.readuntil(_HEAD_END), _HEAD_TIMEOUT_S)
        if refusal := self._find_refusal(head):
            body = refusal.partition(" ")[2]  # the text without the number of the status
            response = f"HTTP/1.1 {refusal}\r\nContent-Length: {len(body)}\r\nConnection: close\r\n\r\n{body}"
            writer.write(response.encode())
            await writer.drain()
            return
        server_reader, server_writer = await asyncio.open_connection(*self._server_address)
        server_writer.write(head)
        await asyncio.gather(_copy_bytes(reader, server_writer), _copy_bytes(server_reader, writer))

    def _find_refusal(self, head: bytes) -> str:
        """Return the status and the reason for a rejection; empty for an accepted request."""
        if self._connection_count > MAX_CONNECTIONS:
            return "503 Too many connections"
        hosts, origins = _find_header_values(head, "host"), _find_header_values(head, "origin")
        if len(hosts) != 1 or len(origins) > 1:
            return "400 The request needs one Host and at most one Origin"
        (host,), origin = hosts, "".join(origins)
        if self._allowed_host_names is not None and not has_host_name(host, self._allowed_host_names):
            return "421 This server has no such name"
        if not is_permitted_request(origin, "http", host, self._allowed_origins):
            return "403 Pages of other origins may not use this server"
        return ""


def _find_header_values(head: bytes, name: str) -> list[str]:
    """Return the values of a header field in the head of a request."""
    fields = (line.partition(":") for line in head.decode("latin-1").split("\r\n")[1:])
    return [value.strip() for field, _, value in fields if field.strip().lower() == name]


async def _copy_bytes(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Forward one direction. At its end, close the target, so that the other direction ends, too."""
    try:
        while piece := await reader.read(_MAX_PIECE_BYTES):
            writer.write(piece)
            await writer.drain()
    finally:
        writer.close()
