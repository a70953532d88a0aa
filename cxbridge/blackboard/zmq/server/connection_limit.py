"""A limit of the connections to a ZeroMQ server; further ones are closed on arrival.

libzmq accepts all connections, and without free file descriptors it retries in a busy loop. It cannot pause
accepting, because unbinding closes accepted connections. The server must therefore keep descriptors free.
Clients that connect without a handshake are dropped after its time limit.
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
    """The connections to the TCP sockets of a server, for the server's thread.

    :param most: the maximal number of connections; a client has two.
    :param report: called with a text for each closed connection.
    """

    def __init__(self, most: int, report: Callable[[str], None]) -> None:
        self._most: Final = most
        self._report: Final = report
        self._inside: set[int] = set()
        self._watched: dict[int, tuple[Socket, Socket, int]] = {}

    def watch(self, context: Context, socket: Socket, endpoint: str) -> None:
        """Monitor a bound socket if its endpoint is TCP."""
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
        """The descriptors of the monitor sockets."""
        return list(self._watched)

    def has_news(self, ready: Iterable[tuple[int, int]]) -> bool:
        """Return whether a monitor socket is among the ready descriptors."""
        return any(descriptor in self._watched for descriptor, _ in ready)

    def look(self) -> None:
        """Process the events of the monitors and close connections above the limit."""
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
        """Close a connection."""
        # the descriptor may belong to another socket by now, hence the check of the port
        self._inside.discard(descriptor)
        with contextlib.suppress(OSError):
            peer = network.socket(fileno=descriptor)
            try:
                if peer.getsockname()[1] == port:
                    peer.shutdown(network.SHUT_RDWR)
                    self._report(f"more than {self._most} connections, the next are ended")
            finally:
                peer.detach()  # libzmq owns the descriptor

    def close(self) -> None:
        """Close the monitors."""
        for socket, monitor, _ in self._watched.values():
            while _next(monitor) is not None:
                pass
            socket.disable_monitor()
            monitor.close(linger=0)
        self._watched.clear()


def _next(monitor: Socket) -> tuple[int, int] | None:
    """Return the next event of a monitor and its descriptor, or None."""
    try:
        event, *_ = monitor.recv_multipart(NOBLOCK)
    except zmq.Again:
        return None
    kind, descriptor = _EVENT.unpack(event)
    return kind, descriptor
