"""Valid and invalid frames of the protocol."""

from __future__ import annotations

import contextlib
import io
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge_studio.dap.protocol import Event
from cxbridge_studio.dap.wire import MAX_MESSAGE_BYTES, Wire, WireError


def make_frame(body: bytes, headers: bytes = b"") -> bytes:
    return headers + b"Content-Length: %d\r\n\r\n" % len(body) + body


class SlowPipe(io.RawIOBase):
    """A pipe that returns at most three bytes at a time."""

    def __init__(self, data: bytes) -> None:
        self._data = io.BytesIO(data)

    def readable(self) -> bool:
        return True

    def readinto(self, buffer) -> int:
        part = self._data.read(min(len(buffer), 3))
        buffer[: len(part)] = part
        return len(part)


def read_all(data: bytes) -> list[tuple[str, bytes]]:
    wire = Wire(SlowPipe(data), io.BytesIO())
    requests = []
    while (request := wire.read()) is not None:
        requests.append((request.command, bytes(request.arguments)))
    return requests


def test_requests_keep_order_over_slow_pipe():
    first = json.dumps({"seq": 1, "type": "request", "command": "threads"}).encode()
    second = json.dumps({"seq": 2, "command": "launch", "arguments": {"scenario": "ä"}}).encode()
    data = make_frame(first) + make_frame(second, b"Content-Type: application/json\r\n")
    assert read_all(data) == [("threads", b"{}"), ("launch", b'{"scenario": "\\u00e4"}')]


def test_truncated_message_ends_input():
    assert read_all(make_frame(b'{"command": "a"}') + b"Content-Length: 50\r\n\r\n{}") == [("a", b"{}")]


@pytest.mark.parametrize(
    "data",
    [
        b"\r\n\r\n",
        b"hello\r\n\r\n",
        b"Content-Length: -1\r\n\r\n",
        b"Content-Length: x\r\n\r\n",
        b"Content-Length: %d\r\n\r\n" % (MAX_MESSAGE_BYTES + 1),
        b"Content-Length: " + b"9" * 5000 + b"\r\n\r\n",
        b"A: b\r\n" * 100,
        make_frame(b"[]"),
        make_frame(b"{"),
        make_frame(b'{"command": 3}'),
    ],
)
def test_invalid_message_is_an_error(data):
    with pytest.raises(WireError):
        read_all(data)


@given(st.binary(max_size=300))
def test_arbitrary_bytes_are_messages_or_an_error(data):
    with contextlib.suppress(WireError):
        read_all(data)


def test_sent_events_are_numbered():
    sink = io.BytesIO()
    wire = Wire(io.BytesIO(), sink)
    wire.write(Event("initialized"))
    wire.write(Event("output", {"output": "ä"}))
    first = b'{"type":"event","event":"initialized","seq":1}'
    second = '{"type":"event","event":"output","body":{"output":"ä"},"seq":2}'.encode()
    assert sink.getvalue() == make_frame(first) + make_frame(second)


def test_write_to_closed_pipe_is_ignored():
    sink = io.BytesIO()
    sink.close()
    Wire(io.BytesIO(), sink).write(Event("initialized"))
