"""A client that sends frames and returns the answers."""

from __future__ import annotations

import contextlib
import socket
from collections import deque

from cxbridge.closing import Closing
from cxbridge_fawkes.network.messages import codec
from cxbridge_fawkes.network.messages.blackboard import BlackBoardMessage
from cxbridge_fawkes.network.messages.codec import client_payload_limit
from cxbridge_fawkes.network.messages.frames import FawkesFrame, FrameDecoder

TIMEOUT = 20.0
"""Timeout in seconds, long enough for a loaded machine."""


class RawClient(Closing):
    """A socket that sends and receives frames."""

    def __init__(self, port: int) -> None:
        self.sock = socket.create_connection(("127.0.0.1", port), TIMEOUT)
        self._decoder = FrameDecoder(client_payload_limit)
        self._frames: deque[FawkesFrame] = deque()

    def close(self) -> None:
        self.sock.close()

    def send(self, *frames: FawkesFrame | bytes) -> None:
        self.sock.sendall(
            b"".join(frame if isinstance(frame, bytes) else frame.to_bytes() for frame in frames)
        )

    def take(self) -> FawkesFrame:
        """Return the next frame."""
        while not self._frames:
            data = self.sock.recv(65536)
            assert data, "the server closed the connection"
            self._frames.extend(self._decoder.feed(data))
        return self._frames.popleft()

    def message(self) -> BlackBoardMessage:
        """Return the next message."""
        return codec.decode(self.take())

    def ask(self, question: BlackBoardMessage) -> BlackBoardMessage:
        """Send a message and return the next received message."""
        self.send(question.to_bytes())
        return self.message()

    def closed_by_server(self) -> bool:
        """Read until the server closes the connection."""
        with contextlib.suppress(ConnectionError):
            while self.sock.recv(65536):
                pass
        return True
