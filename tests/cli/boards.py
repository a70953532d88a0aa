"""A blackboard that commands find under any URL."""

from __future__ import annotations

import threading
from contextlib import contextmanager

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry
from tests.daemon.test_daemon import until

WAIT_S = 15
"""Seconds after which a test gives up."""


class SharedBoard(LocalBlackBoard):
    """Survives the end of a command; counts interfaces that commands left open."""

    def __init__(self):
        super().__init__(InterfaceRegistry(), RealClock())

    def __exit__(self, *_error):
        pass

    def left_open(self):
        """Owners of interfaces that commands opened and did not close."""
        owners = [owner for info in self.list_all() for owner in (info.writer, *info.readers)]
        return [owner for owner in owners if owner.startswith("cxbridge")]


@contextmanager
def board_of(commands, monkeypatch):
    """The board of a module of commands; an interface that a command leaves open fails the test."""
    board = SharedBoard()
    monkeypatch.setattr(commands, "connect", lambda _url, _dirs: board)
    yield board
    assert board.left_open() == []
    board.shutdown()


def wait_for_control(reader, controller=""):
    """Wait until a client has control of a Skiller; by default, until no client has."""

    def has_come():
        reader.read()
        return reader.exclusive_controller == controller

    assert until(has_come), reader.as_dict()


class Looping:
    """Calls a component's ``loop()`` in a thread, as a main loop would; closes the component at the end."""

    def __init__(self, make, period_s=0.002):
        self._make, self._period_s = make, period_s
        self._stop, self._ready = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self):
        component = self._make()
        try:
            self._ready.set()
            while not self._stop.wait(self._period_s):
                component.loop()
        finally:
            component.close()

    def __enter__(self):
        self._thread.start()
        assert self._ready.wait(WAIT_S)
        return self

    def __exit__(self, *_error):
        self._stop.set()
        self._thread.join(WAIT_S)
        assert not self._thread.is_alive()


def silent_bus():
    return EventBus(RealClock())
