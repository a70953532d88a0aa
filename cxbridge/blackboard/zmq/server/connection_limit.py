"""The limit of connections of a server of ZeroMQ: further connections are ended on arrival.

libzmq accepts all connections, and when no file descriptor is left it tries again and again with a whole
core. It offers no pause (to unbind ends accepted connections): so the server must keep descriptors free.
Clients that merely connect leave descriptors for other uses, and are dropped by the handshake's time limit.
"""

from __future__ import annotations

import contextlib
import os
import socket as network
import struct
from collections.abc import Callable, Iterable
from typing import Final

import zmq

from cxbridge.blackboard.zmq.wire.sockets import CLIENT_QUEUE, NOBLOCK, Context, Socket

_EVENT: Final = struct.Struct("=hi")
_WATCHED: Final = zmq.EVENT_ACCEPTED | zmq.EVENT_DISCONNECTED


class ConnectionLimit:
    """The connections of a server's TCP sockets. For the server's thread.

    :param most: connections at a time; a client has two.
    :param report: called when a client is turned away.
    """

    def __init__(self, most: int, report: Callable[[str], None]) -> None:
        self._most: Final = most
        self._report: Final = report
        self._inside: set[int] = set()
        self._watched: dict[int, tuple[Socket, Socket, int]] = {}

    def watch(self, context: Context, socket: Socket, endpoint: str) -> None:
        """Look after a socket that is bound; one for processes of this machine needs none."""
        if not endpoint.startswith("tcp:"):
            return
        address = f"inproc://connections-{os.urandom(8).hex()}"
        socket.monitor(address, int(_WATCHED))
        monitor = context.socket(zmq.PAIR)
        monitor.linger = 0
        monitor.rcvhwm = 8 * CLIENT_QUEUE
        monitor.connect(address)
        self._watched[monitor.fileno()] = socket, monitor, int(endpoint.rpartition(":")[2])

    @property
    def descriptors(self) -> list[int]:
        """The monitor socket that reports connections."""
        return list(self._watched)

    def has_news(self, ready: Iterable[tuple[int, int]]) -> bool:
        """Whether one of these descriptors reports it."""
        return any(descriptor in self._watched for descriptor, _ in ready)

    def look(self) -> None:
        """Note who came and went, and end the connections that are too many."""
        for _, monitor, port in self._watched.values():
            came: dict[int, None] = {}
            while (news := _next(monitor)) is not None:
                event, descriptor = news
                if event == zmq.EVENT_ACCEPTED:
                    came[descriptor] = None
                    self._inside.add(descriptor)
                else:
                    came.pop(descriptor, None)
                    self._inside.discard(descriptor)
            for descriptor in reversed(came):
                if len(self._inside) <= self._most:
                    break
                self._end(descriptor, port)

    def _end(self, descriptor: int, port: int) -> None:
        """End a connection, if it is still one to this port: its number may be another's by now."""
        self._inside.discard(descriptor)
        with contextlib.suppress(OSError):
            peer = network.socket(fileno=descriptor)
            try:
                if peer.getsockname()[1] == port:
                    peer.shutdown(network.SHUT_RDWR)
                    self._report(f"more than {self._most} connections, the next are ended")
            finally:
                peer.detach()  # it is libzmq's

    def close(self) -> None:
        """Look after nothing any more."""
        for socket, monitor, _ in self._watched.values():
            while _next(monitor) is not None:
                pass
            socket.disable_monitor()
            monitor.close(linger=0)
        self._watched.clear()


def _next(monitor: Socket) -> tuple[int, int] | None:
    """Return the next event of a monitor, and its descriptor; None when there is none."""
    try:
        event, *_ = monitor.recv_multipart(NOBLOCK)
    except zmq.Again:
        return None
    kind, descriptor = _EVENT.unpack(event)
    return kind, descriptor
