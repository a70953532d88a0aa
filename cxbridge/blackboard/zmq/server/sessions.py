"""A session of the server: open instances of a client, and the stream of frames to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

import zmq

from cxbridge.blackboard.zmq.wire.codec import ResultCode, encode
from cxbridge.blackboard.zmq.wire.dataframes import AnswerBody, DeliverBody, pack_answer, pack_deliver
from cxbridge.blackboard.zmq.wire.sockets import MORE, NOBLOCK, sender
from cxbridge.interfaces.instance import Interface

EVENTS: Final = b"e"
"""The first byte of the routing id of a client's events socket."""

COMMANDS: Final = b"c"
"""The first byte of the routing id of a client's commands socket."""

# below three, so that the check, four times a heartbeat, notices it within three
DEATH: Final = 2.5
"""The number of heartbeats without a frame after which a peer is dead."""

# below one, so that each interval has a frame
BEAT: Final = 0.75
"""The number of heartbeats without sending after which a Beat is sent."""


class UpdateSource(Protocol):
    """Sends updates of an interface to sessions."""

    def push_latest(self, session: ZmqSession) -> None:
        """Send the present data to a session."""


@dataclass(slots=True)
class Membership:
    """A session's state of an interface.

    :param sent: the sequence number of the client's copy.
    :param instances: the serials of the session's instances.
    """

    sent: int
    instances: set[bytes] = field(default_factory=set)


@dataclass(slots=True, eq=False)
class ZmqSession:
    """A connected client.

    :param id: 16 bytes.
    :param socket: the ROUTER socket to which it is connected.
    :param heartbeat: in seconds.
    :param window: the maximal number of unacknowledged updates.
    :param fail: called when the session cannot continue, with the reason.
    :param now: returns the monotonic time in seconds.
    """

    id: bytes
    socket: zmq.Socket[bytes]
    name: str
    heartbeat: float
    window: int
    fail: Callable[[ZmqSession, ResultCode], None]
    now: Callable[[], float]
    credit: int = 0
    numbers_in: int = 0
    numbers_out: int = 0
    last_received_s: float = 0.0
    sent: float = 0.0
    watching: bool = False
    failed: bool = False
    skipped: int = 0
    pending: int = 0
    instances: dict[bytes, Interface] = field(default_factory=dict)
    memberships: dict[UpdateSource, Membership] = field(default_factory=dict)
    dirty: dict[UpdateSource, None] = field(default_factory=dict)
    _route: bytes = b""
    _send: Callable[..., Any] = field(init=False)

    def __post_init__(self) -> None:
        self.credit = self.window
        self.last_received_s = self.sent = self.now()
        self._route = EVENTS + self.id
        self._send = sender(self.socket)

    def __str__(self) -> str:
        return self.name or self.id.hex()[:8]

    def send(self, kind: str, body: dict[str, Any], block: bytes | None = None) -> None:
        """Send an envelope in order."""
        self._send_next(encode(kind, self.numbers_out + 1, body), block)

    def answer(self, request: int, code: ResultCode, detail: int = 0, text: str = "") -> None:
        """Reply to a Send."""
        self._send_next(pack_answer(self.numbers_out + 1, AnswerBody(request, code, detail, text)))

    def deliver(self, body: DeliverBody, block: bytes) -> None:
        """Send a message to a writer of the client."""
        self._send_next(pack_deliver(self.numbers_out + 1, body, block))

    def _send_next(self, frame: bytes, block: bytes | None = None) -> None:
        self.numbers_out += 1
        self.send_frame(frame, block)

    def send_frame(self, frame: bytes, block: bytes | None = None) -> None:
        """Send an encoded frame, which may be shared by sessions."""
        if self.failed:
            return
        send = self._send
        try:
            send(self._route, MORE)
            if block is None:
                send(frame, NOBLOCK)
            else:
                send(frame, MORE)
                send(block, NOBLOCK)
        except zmq.Again:
            self.fail(self, ResultCode.TOO_SLOW)
        except zmq.ZMQError:  # the connection is lost
            self.fail(self, ResultCode.SILENT)
        else:
            self.sent = self.now()

    def reply(
        self, request: int, code: ResultCode = ResultCode.OK, *, block: bytes | None = None, **fields: object
    ) -> None:
        self.send("reply", {"request": request, "code": int(code), **fields}, block)

    def give_credit(self, count: int) -> None:
        """Add credit for ``count`` updates and send the waiting interfaces."""
        self.credit = min(self.credit + count, self.window)
        while self.credit > 0 and self.dirty:
            channel = next(iter(self.dirty))
            del self.dirty[channel]
            channel.push_latest(self)

    def check_alive(self, now: float) -> None:
        """Send a heartbeat if it is due; fail the session if the client was silent for too long."""
        if now - self.last_received_s > DEATH * self.heartbeat:
            self.fail(self, ResultCode.SILENT)
        elif now - self.sent > BEAT * self.heartbeat:
            self.send("beat", {})
