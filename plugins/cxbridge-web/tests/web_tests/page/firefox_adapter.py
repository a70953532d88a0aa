"""Starts an installed Firefox for playwright, and stands between the two.

Playwright drives a Firefox that it did not build over WebDriver BiDi. It also sends commands that this
Firefox may not know (emulation of media features, of screens), and takes their refusal for the end. The
adapter passes on everything, but says "done" where an emulation is refused as an unknown command: the tests
in Firefox do without it.

Run as a program in the place of ``firefox``; the variable ``CXBRIDGE_FIREFOX`` names the real one.
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import struct
import sys
from typing import Any

_LISTENING = re.compile(rb"WebDriver BiDi listening on ws://([^:]+):(\d+)")
_HOST = re.compile(rb"(?im)^(host: *)[^\r]*\r")
_TEXT_FRAME, _SMALL, _MIDDLE = 0x81, 126, 127


def mended(payload: bytes) -> bytes:
    """Return a message of Firefox's as playwright gets it."""
    if b'"unknown command"' not in payload:
        return payload
    message: dict[str, Any] = json.loads(payload)
    if message.get("type") != "error" or "emulation." not in message.get("message", ""):
        return payload
    return json.dumps({"type": "success", "id": message["id"], "result": {}}).encode()


async def _frames(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Pass on the server's bytes: its handshake, then WebSocket frames, which a server does not mask."""
    writer.write(await reader.readuntil(b"\r\n\r\n"))
    while True:
        first, size = await reader.readexactly(2)
        if size == _SMALL:
            (size,) = struct.unpack(">H", await reader.readexactly(2))
        elif size == _MIDDLE:
            (size,) = struct.unpack(">Q", await reader.readexactly(8))
        payload = await reader.readexactly(size)
        if first == _TEXT_FRAME:
            payload = mended(payload)
        size = len(payload)
        if size < _SMALL:
            head = struct.pack(">BB", first, size)
        elif size < 1 << 16:
            head = struct.pack(">BBH", first, _SMALL, size)
        else:
            head = struct.pack(">BBQ", first, _MIDDLE, size)
        writer.write(head + payload)
        await writer.drain()


async def _bytes(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(1 << 16):
        writer.write(data)
        await writer.drain()


async def _main() -> int:
    firefox = await asyncio.create_subprocess_exec(
        os.environ["CXBRIDGE_FIREFOX"], *sys.argv[1:], stderr=asyncio.subprocess.PIPE, limit=1 << 22
    )
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, firefox.terminate)
    real: asyncio.Future[tuple[str, int]] = asyncio.get_running_loop().create_future()

    async def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        host, at = await real
        server_reader, server_writer = await asyncio.open_connection(host, at)
        handshake = await reader.readuntil(b"\r\n\r\n")
        server_writer.write(_HOST.sub(b"\\g<1>%s:%d\r" % (host.encode(), at), handshake))
        ways = [_bytes(reader, server_writer), _frames(server_reader, writer)]
        await asyncio.wait([asyncio.ensure_future(way) for way in ways], return_when="FIRST_COMPLETED")
        server_writer.close()
        writer.close()

    server = await asyncio.start_server(connected, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    assert firefox.stderr is not None
    async for line in firefox.stderr:
        found = _LISTENING.search(line)
        if found and not real.done():
            real.set_result((found[1].decode(), int(found[2])))
            line = _LISTENING.sub(b"WebDriver BiDi listening on ws://127.0.0.1:%d" % port, line)  # noqa: PLW2901
        sys.stderr.buffer.write(line)
        sys.stderr.buffer.flush()
    return await firefox.wait()


if __name__ == "__main__":
    sys.exit(asyncio.run(_main()))
