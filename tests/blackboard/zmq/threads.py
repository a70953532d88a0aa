"""Detects two threads in a ZeroMQ socket at once, which libzmq neither supports nor reports.

The check covers calls of Python: methods of sockets and pollers, and the functions of
:mod:`cxbridge.blackboard.zmq.wire.sockets`.
"""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from weakref import WeakKeyDictionary

import pytest
import zmq

from cxbridge.blackboard.zmq.client import receiving, sending
from cxbridge.blackboard.zmq.server import server, sessions
from cxbridge.blackboard.zmq.wire import sockets

METHODS = (
    *("bind", "unbind", "connect", "disconnect", "close", "monitor"),
    *("send", "recv", "poll", "get", "getsockopt", "set", "setsockopt"),
)


Bound = Callable[..., Any]


class SocketUse:
    """The threads in sockets.

    :ivar faults: the detected faults, with the stacks of both threads.
    """

    def __init__(self) -> None:
        self.faults: list[str] = []
        self._lock = threading.Lock()
        self._inside: WeakKeyDictionary[Any, tuple[threading.Thread, str, int]] = WeakKeyDictionary()

    @contextmanager
    def entered(self, socket: Any, method: str) -> Iterator[None]:
        """Register the current thread in a socket.

        :raises AssertionError: if another thread is in the socket.
        """
        current = threading.current_thread()
        with self._lock:
            thread, other, depth = self._inside.get(socket, (current, method, 0))
            if thread is not current:
                here = "".join(traceback.format_stack(limit=8))
                fault = f"{method} in {current.name} during {other} in {thread.name}:\n{here}"
                self.faults.append(fault)
                raise AssertionError(fault)
            self._inside[socket] = (current, other, depth + 1)
        try:
            yield
        finally:
            with self._lock:
                if depth:
                    self._inside[socket] = (current, other, depth)
                else:
                    del self._inside[socket]

    def is_used(self, socket: Any) -> bool:
        """Return whether a thread is in a socket."""
        with self._lock:
            return socket in self._inside

    def method(self, name: str, original: Bound) -> Bound:
        """Return a method of sockets that registers its thread."""

        def registered(socket: Any, *args: Any, **options: Any) -> Any:
            with self.entered(socket, name):
                return original(socket, *args, **options)

        return registered

    def without_layer(self, original: Callable[[Any], Bound]) -> Callable[[Any], Bound]:
        """Return ``raw_send`` or ``raw_receive`` whose functions register their thread."""

        def make(socket: Any) -> Bound:
            bound = original(socket)

            def registered(*args: Any) -> Any:
                with self.entered(socket, original.__name__):
                    return bound(*args)

            return registered

        return make

    def polling(self, original: Bound) -> Bound:
        """Return ``poll`` of pollers, registered in all their sockets during the call."""

        def poll(poller: Any, *args: Any) -> Any:
            sockets_of_poller = [socket for socket, _ in poller.sockets if isinstance(socket, zmq.Socket)]
            return self._poll_in(sockets_of_poller, lambda: original(poller, *args))

        return poll

    def _poll_in(self, sockets_of_poller: list[Any], original: Callable[[], Any]) -> Any:
        if not sockets_of_poller:
            return original()
        with self.entered(sockets_of_poller[0], "poll"):
            return self._poll_in(sockets_of_poller[1:], original)


@contextmanager
def watched_sockets() -> Iterator[SocketUse]:
    """Watch all sockets of this process.

    :raises AssertionError: at the end, if two threads were in a socket at once.
    """
    use = SocketUse()
    with pytest.MonkeyPatch.context() as patch:
        for name in METHODS:
            patch.setattr(zmq.Socket, name, use.method(name, getattr(zmq.Socket, name)))
        patch.setattr(zmq.Poller, "poll", use.polling(zmq.Poller.poll))
        send, receive = use.without_layer(sockets.raw_send), use.without_layer(sockets.raw_receive)
        patch.setattr(sending, "raw_send", send)
        patch.setattr(sessions, "raw_send", send)
        patch.setattr(receiving, "raw_receive", receive)
        patch.setattr(server, "raw_receive", receive)
        yield use
    assert not use.faults, "\n".join(use.faults)
