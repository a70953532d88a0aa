"""The detection of two threads in a socket."""

from __future__ import annotations

import threading
from typing import Any

import pytest
import zmq

from tests.blackboard.zmq.support import eventually
from tests.blackboard.zmq.threads import watched_sockets


def poll(socket: Any) -> None:
    poller = zmq.Poller()
    poller.register(socket, zmq.POLLIN)
    poller.poll()


def use_while_another_thread_waits(socket: Any, wait: threading.Thread, end: Any) -> None:
    with watched_sockets() as use:
        wait.start()
        eventually(lambda: use.is_used(socket))
        try:
            socket.get(zmq.TYPE)
        finally:
            end()
            wait.join()


@pytest.mark.parametrize("wait", [lambda socket: socket.recv(), poll], ids=["recv", "poll"])
def test_use_of_socket_by_two_threads_is_detected(wait: Any) -> None:
    with zmq.Context() as context, context.socket(zmq.PULL) as pull, context.socket(zmq.PUSH) as push:
        pull.bind("inproc://found")
        push.connect("inproc://found")
        thread = threading.Thread(target=lambda: wait(pull), name="waits")
        with pytest.raises(AssertionError, match=r"get in .* during .* in waits"):
            use_while_another_thread_waits(pull, thread, lambda: push.send(b""))
