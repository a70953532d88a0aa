"""The options by which a command gets to a blackboard."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.resources import DAEMON_URL

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard

TIMED_OUT = 3
"""Exit status when the time is over before what was waited for came."""

DEFAULT_URL = DAEMON_URL

Connect = Annotated[
    str,
    typer.Option(
        "--connect",
        metavar="URL",
        envvar="CXBRIDGE_CONNECT",
        help="the blackboard: tcp://HOST:PORT or ipc://FILE of a daemon, fawkes://HOST[:PORT] of a Fawkes; "
        "tcp://HOST:PORT?key=FILE&server-key=FILE with CURVE keys",
    ),
]
InterfaceDirs = Annotated[
    list[Path] | None,
    typer.Option(
        "--interface-dir",
        metavar="DIR",
        help="look for interface definitions here before cxbridge's own; may be given several times",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="print JSON")]


def connect(url: str, interface_dirs: list[Path] | None) -> BlackBoard:
    """Open the blackboard at ``url``.

    :raises CxbridgeError: when nobody is there, or the URL makes no sense.
    """
    from cxbridge.blackboard.urls import open_blackboard
    from cxbridge.clock import RealClock
    from cxbridge.interfaces.registry import InterfaceRegistry

    return open_blackboard(url, InterfaceRegistry(interface_dirs or ()), RealClock())
