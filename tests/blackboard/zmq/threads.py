"""Finds out when two threads are in one socket of ZeroMQ at once: libzmq does not bear that, nor tell of it.

It sees what goes through Python: methods of sockets, pollers, and what
:mod:`cxbridge.blackboard.zmq.wire.sockets`
hands out to do without them.
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
    """Which thread is in which socket.

    :ivar faults: what was found, with the stacks of both threads.
    """

    def __init__(self) -> None:
        self.faults: list[str] = []
        self._lock = threading.Lock()
        self._inside: WeakKeyDictionary[Any, tuple[threading.Thread, str, int]] = WeakKeyDictionary()

    @contextmanager
    def of(self, socket: Any, what: str) -> Iterator[None]:
        """Be in a socket for a while.

        :raises AssertionError: when another thread is.
        """
        me = threading.current_thread()
        with self._lock:
            thread, other, depth = self._inside.get(socket, (me, what, 0))
            if thread is not me:
                here = "".join(traceback.format_stack(limit=8))
                fault = f"{what} in {me.name} during {other} in {thread.name}:\n{here}"
                self.faults.append(fault)
                raise AssertionError(fault)
            self._inside[socket] = (me, other, depth + 1)
        try:
            yield
        finally:
            with self._lock:
                if depth:
                    self._inside[socket] = (me, other, depth)
                else:
                    del self._inside[socket]

    def is_used(self, socket: Any) -> bool:
        """Return whether a thread is in it."""
        with self._lock:
            return socket in self._inside

    def method(self, name: str, really: Bound) -> Bound:
        """Return a socket's method that notes who is in it."""

        def noted(socket: Any, *args: Any, **options: Any) -> Any:
            with self.of(socket, name):
                return really(socket, *args, **options)

        return noted

    def without_layer(self, really: Callable[[Any], Bound]) -> Callable[[Any], Bound]:
        """Return ``sender`` or ``receiver`` so that what it returns notes who uses it."""

        def make(socket: Any) -> Bound:
            bound = really(socket)

            def noted(*args: Any) -> Any:
                with self.of(socket, really.__name__):
                    return bound(*args)

            return noted

        return make

    def polling(self, really: Bound) -> Bound:
        """Return a poller's ``poll`` that is in all of its sockets meanwhile."""

        def poll(poller: Any, *args: Any) -> Any:
            found = [one for one, _ in poller.sockets if isinstance(one, zmq.Socket)]
            return self._poll_in(found, lambda: really(poller, *args))

        return poll

    def _poll_in(self, found: list[Any], really: Callable[[], Any]) -> Any:
        if not found:
            return really()
        with self.of(found[0], "poll"):
            return self._poll_in(found[1:], really)


@contextmanager
def watched_sockets() -> Iterator[SocketUse]:
    """Watch all sockets of this process.

    :raises AssertionError: at the end, when two threads were in one at once.
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
