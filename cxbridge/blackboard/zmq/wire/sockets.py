"""Sockets of ZeroMQ, configured for both peers of the transport.

The limits of queues bound the memory for a slow peer: a full queue refuses the frame, and the sender
conflates updates or ends the session.
"""

from __future__ import annotations

import contextlib
import socket as unix
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import zmq

from cxbridge.blackboard.kit.errors import EndpointError
from cxbridge.blackboard.zmq.security import CurveClient, CurveServer, uses_curve
from cxbridge.blackboard.zmq.wire.frames import MAX_FRAME_BYTES, MAX_REPLY_BYTES

if TYPE_CHECKING:
    from collections.abc import Callable

# above the window of 1024 updates, so that updates alone never fill the queue
MAX_SERVER_QUEUE = 4096
"""The maximum number of frames waiting for a client."""

MAX_CLIENT_QUEUE = 1000
"""The maximum number of frames waiting for the server, ZeroMQ's default."""

# the operating system of a client beyond the limit retries only after a second
MAX_SERVER_BACKLOG = 1024
"""The maximum number of connections waiting to be accepted."""

# for a Bye or a Gone; ending the context waits at most as long
LINGER_MS = 300
"""The milliseconds in which a closed socket may send its last messages."""

# a thread of ZeroMQ releases the endpoint of a closed socket after `close` has returned
ENDPOINT_WAIT_S = 0.5
"""The seconds to wait for an endpoint in use."""

# half of ZeroMQ's default, because a client reconnects within about 0.1 s after the server starts again
RECONNECT_MS = 50
"""The milliseconds between attempts to connect."""


Context = zmq.Context[zmq.Socket[bytes]]
Socket = zmq.Socket[bytes]

NOBLOCK = int(zmq.NOBLOCK)  # plain integers, because combining flags makes an object each time
SEND_MORE = int(zmq.NOBLOCK | zmq.SNDMORE)
_POLLIN = int(zmq.POLLIN)


def make_context() -> Context:
    """Return a new context, which the caller must terminate.

    :raises EndpointError: on Windows, where sockets of ZeroMQ cannot be polled by descriptor.
    """
    if sys.platform == "win32":
        raise EndpointError(
            "blackboards over ZeroMQ do not work on Windows, which cannot poll their descriptors",
            hint="use WSL, or fawkes:// URLs; zmq/endpoints: [] turns them off in a daemon",
        )
    return zmq.Context()


def bind(context: Context, endpoint: str, keys: CurveServer | None) -> tuple[Socket, str]:
    """Return a bound server socket and the endpoint with its actual port.

    :raises EndpointError: if the endpoint cannot be bound or is in use, or a key is unusable.
    """
    _check_endpoint_free(endpoint)
    socket = context.socket(zmq.ROUTER)
    try:
        _configure(socket, endpoint, MAX_FRAME_BYTES, keys)
        socket.router_mandatory = True  # otherwise a ROUTER silently drops frames for a lost client
        socket.sndhwm = MAX_SERVER_QUEUE
        socket.rcvhwm = MAX_CLIENT_QUEUE
        # in milliseconds; ends the connection of a peer that stays silent; ZeroMQ's default is 30 seconds
        socket.handshake_ivl = 5000
        socket.backlog = MAX_SERVER_BACKLOG
        _bind_with_retries(socket, endpoint)
        restrict_file(endpoint)
    except zmq.ZMQError as error:
        socket.close()
        raise EndpointError(f"cannot listen on {endpoint}: {error.strerror}") from error
    except BaseException:
        socket.close()
        raise
    if not endpoint.startswith("tcp:"):
        return socket, endpoint
    return socket, socket.get_string(zmq.LAST_ENDPOINT).rstrip("\0")


def _configure(
    socket: Socket, endpoint: str, max_frame_bytes: int, keys: CurveServer | CurveClient | None
) -> None:
    """Set the options of both peers."""
    socket.linger = 0  # a closed socket must not delay the end of the process
    socket.ipv6 = "[" in endpoint  # URLs have IPv6 addresses in brackets
    socket.maxmsgsize = max_frame_bytes
    if keys is not None and uses_curve(endpoint):
        keys.apply(socket)


def restrict_file(endpoint: str) -> None:
    """Restrict the file of an ipc endpoint to this user."""
    if path := _ipc_path(endpoint):
        path.chmod(0o600)


def _check_endpoint_free(endpoint: str) -> None:
    """Check that no process serves an ipc endpoint, because libzmq would silently take the endpoint over."""
    path = _ipc_path(endpoint)
    if path is None:
        return
    deadline_s = time.monotonic() + ENDPOINT_WAIT_S
    while _is_served(str(path)):
        if time.monotonic() > deadline_s:
            raise EndpointError(
                f"another process serves {endpoint} already", hint="is another daemon running?"
            )
        time.sleep(0.01)


def _ipc_path(endpoint: str) -> Path | None:
    """Return the file of an ipc endpoint; None for tcp and for abstract sockets (``@``), which have none."""
    path = endpoint.removeprefix("ipc://")
    return None if path == endpoint or path.startswith("@") else Path(path)


def remove_file(endpoint: str) -> None:
    """Remove the file of a bound ipc endpoint, which libzmq does not remove.

    The caller unbinds the endpoint afterwards, not before: while this process serves the endpoint, no other
    daemon can have replaced the file.
    """
    if path := _ipc_path(endpoint):
        with contextlib.suppress(OSError):  # the permissions may have changed
            path.unlink()


def _is_served(path: str) -> bool:
    """Return whether a process listens at a Unix socket."""
    if sys.platform == "win32":
        return False
    with unix.socket(unix.AF_UNIX, unix.SOCK_STREAM) as probe:
        probe.settimeout(ENDPOINT_WAIT_S)
        try:
            probe.connect(path)
        except OSError:
            return False
    return True


def is_readable(socket: Socket) -> bool:
    """Return whether a frame can be received at once."""
    events = socket.getsockopt(zmq.EVENTS)
    return isinstance(events, int) and bool(events & _POLLIN)


def raw_send(socket: Socket) -> Callable[..., Any]:
    """Return the ``send(data, flags)`` of the underlying C socket."""
    # the method of pyzmq's Python class takes twice as long
    send: Callable[..., Any] = super(zmq.Socket, socket).send
    return send


def raw_receive(socket: Socket) -> Callable[..., Any]:
    """Return the ``recv(flags, copy)`` of the underlying C socket; see :func:`raw_send`."""
    recv: Callable[..., Any] = super(zmq.Socket, socket).recv
    return recv


def skip_parts(socket: Socket) -> int:
    """Receive the remaining parts of a message; return their number."""
    # without waiting, because libzmq delivers all parts of a message at once
    count = 0
    while socket.getsockopt(zmq.RCVMORE):
        socket.recv()
        count += 1
    return count


def _bind_with_retries(socket: Socket, endpoint: str) -> None:
    """Bind a socket, and retry while ZeroMQ releases the endpoint of a closed socket."""
    deadline_s = time.monotonic() + ENDPOINT_WAIT_S
    while True:
        try:
            socket.bind(endpoint)
        except zmq.ZMQError as error:
            if error.errno != zmq.EADDRINUSE or time.monotonic() > deadline_s:
                raise
            time.sleep(0.01)
        else:
            return


def connect(context: Context, endpoint: str, route: bytes, keys: CurveClient | None) -> Socket:
    """Return a client socket that connects as soon as the server runs.

    :param route: the routing id of the client.
    :raises EndpointError: if the endpoint is invalid, or a key is unusable.
    """
    socket = context.socket(zmq.DEALER)
    try:
        _configure(socket, endpoint, MAX_REPLY_BYTES, keys)
        socket.routing_id = route
        socket.sndhwm = MAX_CLIENT_QUEUE
        socket.rcvhwm = MAX_SERVER_QUEUE
        socket.reconnect_ivl = RECONNECT_MS
        socket.connect(endpoint)
    except zmq.ZMQError as error:
        socket.close()
        raise EndpointError(f"cannot connect to {endpoint}: {error.strerror}") from error
    except BaseException:
        socket.close()
        raise
    return socket
