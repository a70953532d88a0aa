"""A session of the server: the open instances of a client, and the stream of frames to the client.

The server sends at most `window` updates that the client has not acknowledged (credit). An update of an
interface waits while the session has no credit; a later update replaces the waiting update (conflation).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import zmq

from cxbridge.blackboard.zmq.wire.frames import (
    BEAT_HEARTBEATS,
    DEATH_HEARTBEATS,
    EVENTS_PREFIX,
    Beat,
    Frame,
    Reply,
    ResultCode,
    encode,
)
from cxbridge.blackboard.zmq.wire.sockets import NOBLOCK, SEND_MORE, raw_send
from cxbridge.interfaces.instance import Interface


class UpdateChannel(Protocol):
    """Sends updates of an interface to sessions, see :class:`~.channels.Channel`."""

    def send_latest(self, session: ZmqSession) -> None:
        """Send the present data to a session."""


@dataclass(slots=True)
class Membership:
    """A session's state in the channel of an interface.

    :param sent_seq: the sequence number of the client's copy.
    :param instance_serials: the serials of the session's instances of the interface.
    """

    sent_seq: int
    instance_serials: set[bytes] = field(default_factory=set)


@dataclass(slots=True, eq=False)
class ZmqSession:
    """A connected client.

    :param id: the id of the session, 16 bytes.
    :param socket: the ROUTER socket to which the client is connected.
    :param name: identifies the client in log lines.
    :param heartbeat_s: the seconds between signs of life.
    :param window: the maximum number of unacknowledged updates.
    :param fail: called when the session cannot continue, with the reason.
    :param now: returns the monotonic time in seconds.
    :param credit: the number of updates that the server may send before the next acknowledgement.
    :param is_watching: whether the client gets Existence frames.
    :param has_failed: whether the server will end the session, which receives and sends no frames any more.
    :param pending_count: the number of messages whose outcome the client has not reported.
    :param instances: the client's instances by serial.
    :param memberships: the state of the session in each channel.
    :param waiting_channels: the channels with an update that waits for credit, oldest first.
    """

    id: bytes
    socket: zmq.Socket[bytes]
    name: str
    heartbeat_s: float
    window: int
    fail: Callable[[ZmqSession, ResultCode], None]
    now: Callable[[], float]
    credit: int = 0
    last_number_received: int = 0
    last_number_sent: int = 0
    last_received_s: float = 0.0
    last_sent_s: float = 0.0
    is_watching: bool = False
    has_failed: bool = False
    pending_count: int = 0
    instances: dict[bytes, Interface] = field(default_factory=dict)
    memberships: dict[UpdateChannel, Membership] = field(default_factory=dict)
    waiting_channels: dict[UpdateChannel, None] = field(default_factory=dict)
    _route: bytes = b""
    _send: Callable[..., Any] = field(init=False)

    def __post_init__(self) -> None:
        self.credit = self.window
        self.last_received_s = self.last_sent_s = self.now()
        self._route = EVENTS_PREFIX + self.id
        self._send = raw_send(self.socket)

    def __str__(self) -> str:
        return self.name or self.id.hex()[:8]

    def send(self, frame: Frame) -> None:
        """Send a frame with the next number.

        :raises ProtocolError: if the frame cannot be encoded.
        """
        frame.number = self.last_number_sent + 1
        frame_bytes = encode(frame)
        # after the encoding, because a frame that cannot be encoded must leave no gap
        self.last_number_sent += 1
        self.send_bytes(frame_bytes)

    def send_bytes(self, frame_bytes: bytes) -> None:
        """Send an encoded frame, which several sessions may share if it has no number."""
        if self.has_failed:
            return
        try:
            self._send(self._route, SEND_MORE)
            self._send(frame_bytes, NOBLOCK)
        except zmq.Again:
            self.fail(self, ResultCode.TOO_SLOW)
        except zmq.ZMQError:  # the connection is lost
            self.fail(self, ResultCode.SILENT)
        else:
            self.last_sent_s = self.now()

    def reply(self, request: int, code: ResultCode = ResultCode.OK, detail: int = 0) -> None:
        """Send the outcome of a request."""
        self.send(Reply(code, detail, request=request))

    def give_credit(self, count: int) -> None:
        """Add credit for ``count`` updates and send the updates that wait for credit."""
        # the limit, because a faulty client may acknowledge more updates than it has received
        self.credit = min(self.credit + count, self.window)
        while self.credit > 0 and self.waiting_channels:
            channel = next(iter(self.waiting_channels))
            del self.waiting_channels[channel]
            channel.send_latest(self)

    def keep_alive(self, now_s: float) -> None:
        """Send a heartbeat if it is due; fail the session if the client was silent for too long."""
        if now_s - self.last_received_s > DEATH_HEARTBEATS * self.heartbeat_s:
            self.fail(self, ResultCode.SILENT)
        elif now_s - self.last_sent_s > BEAT_HEARTBEATS * self.heartbeat_s:
            self.send(Beat())
