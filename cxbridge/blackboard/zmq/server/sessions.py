"""A session of the server: the open instances of one client, and the stream to it."""

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
"""First byte of the routing id of a client's socket for events."""

COMMANDS: Final = b"c"
"""First byte of the routing id of a client's socket for commands."""

DEATH: Final = 2.5
"""Heartbeats of silence after which a peer is dead; it is noticed within three."""

BEAT: Final = 0.75
"""Heartbeats of having sent nothing after which a Beat is due, so that one is sent in each."""


class UpdateSource(Protocol):
    """An interface whose updates a session gets."""

    def push_latest(self, session: ZmqSession) -> None:
        """Send the session the present data."""


@dataclass(slots=True)
class Membership:
    """A session's state of an interface.

    :param sent: sequence number that the client's copy has.
    :param instances: serials of the session's instances.
    """

    sent: int
    instances: set[bytes] = field(default_factory=set)


@dataclass(slots=True, eq=False)
class ZmqSession:
    """One living client.

    :param id: 16 bytes.
    :param socket: the ROUTER that it came by.
    :param heartbeat: seconds.
    :param window: the number of updates that may be under way to it.
    :param fail: called for a session that cannot continue, with the reason.
    :param now: seconds, monotonic.
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
        """Send an envelope, in order after earlier frames."""
        self._send_next(encode(kind, self.numbers_out + 1, body), block)

    def answer(self, request: int, code: ResultCode, detail: int = 0, text: str = "") -> None:
        """Answer a Send."""
        self._send_next(pack_answer(self.numbers_out + 1, AnswerBody(request, code, detail, text)))

    def deliver(self, body: DeliverBody, block: bytes) -> None:
        """Send a message to one of the client's writers."""
        self._send_next(pack_deliver(self.numbers_out + 1, body, block))

    def _send_next(self, frame: bytes, block: bytes | None = None) -> None:
        """Send a frame with the next number; a frame that cannot be encoded takes no number."""
        self.numbers_out += 1
        self.send_frame(frame, block)

    def send_frame(self, frame: bytes, block: bytes | None = None) -> None:
        """Send an encoded frame, e.g. an update for many sessions."""
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
        except zmq.ZMQError:  # its connection is gone
            self.fail(self, ResultCode.SILENT)
        else:
            self.sent = self.now()

    def reply(
        self, request: int, code: ResultCode = ResultCode.OK, *, block: bytes | None = None, **fields: object
    ) -> None:
        """Answer a request."""
        self.send("reply", {"request": request, "code": int(code), **fields}, block)

    def give_credit(self, count: int) -> None:
        """Note that the client has taken ``count`` updates, and send what had to wait."""
        self.credit = min(self.credit + count, self.window)
        while self.credit > 0 and self.dirty:
            channel = next(iter(self.dirty))
            del self.dirty[channel]
            channel.push_latest(self)

    def check_alive(self, now: float) -> None:
        """Send a heartbeat when it is due; fail when the client was silent for too long."""
        if now - self.last_received_s > DEATH * self.heartbeat:
            self.fail(self, ResultCode.SILENT)
        elif now - self.sent > BEAT * self.heartbeat:
            self.send("beat", {})
