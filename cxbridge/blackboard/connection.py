"""Connections to the blackboard of a daemon or of Fawkes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import RealClock
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.resources import DAEMON_URL


def connect(url: str = DAEMON_URL, *, interface_dirs: Sequence[str | Path] = ()) -> BlackBoard:
    """Connect to the blackboard at a URL; the blackboard is a context manager.

    For example::

        with cx.connect("fawkes://robot:1910") as board:
            battery = board.open_for_reading(cx.BatteryInterface, "Robot")
            battery.read()
            print(battery.voltage)

    :param url: ``tcp://HOST:PORT`` or ``ipc://FILE`` of a daemon, ``fawkes://HOST[:PORT]`` of Fawkes, or
        ``local:`` for a blackboard of this program; by default the daemon of this machine.
    :param interface_dirs: folders with interface definitions, searched first.
    :raises BadUrlError: if the URL has an unknown scheme.
    :raises BlackBoardError: if the URL is invalid in another way, or no server replies.
    """
    return open_blackboard(url, InterfaceRegistry(map(Path, interface_dirs)), RealClock())
