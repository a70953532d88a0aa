"""The shell of services: what stops them, and what systemd and the console hear of them."""

from __future__ import annotations

import signal
import socket
from collections.abc import Callable

import pytest

from cxbridge.daemon.services.service import Service


@pytest.fixture
def manager(tmp_path, monkeypatch):
    """The notifications for systemd."""
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(path)
        listener.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", path)
        yield listener


def told(listener):
    """All that has come."""
    found = []
    while True:
        try:
            found.append(listener.recv(4096).decode())
        except BlockingIOError:
            return found


def test_systemd_hears_when_it_is_ready_and_when_it_stops(manager):
    stops: list[Callable[[], None]] = []
    with Service(on_ready=stops.append) as service:
        assert told(manager) == []
        service.report_ready("mirroring a and b")
        assert told(manager) == ["READY=1\nSTATUS=mirroring a and b"]
        stops[0]()
        assert service.stopped.is_set()
    assert told(manager) == ["STOPPING=1"]


def test_one_that_was_never_ready_does_not_say_that_it_stops(manager):
    with Service() as service:
        service.stop()
    assert told(manager) == []


def test_a_signal_stops_and_wakes_it():
    woken = []
    with Service() as service:
        service.set_wake_function(lambda: woken.append(True))
        signal.raise_signal(signal.SIGTERM)
        assert service.stopped.wait(20)
    assert woken


def test_what_would_wake_it_comes_after_the_stop():
    woken = []
    with Service() as service:
        service.stop()
        service.set_wake_function(lambda: woken.append(True))
        assert woken == [True]
