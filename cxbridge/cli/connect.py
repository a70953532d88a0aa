"""The options by which a command gets to a blackboard."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.process.options import CONNECT, INTERFACE_DIR
from cxbridge.resources import DAEMON_URL

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard

TIMED_OUT = 3
"""Exit status when the time is over before what was waited for came."""

DEFAULT_URL = DAEMON_URL

Connect = Annotated[str, CONNECT]
InterfaceDirs = Annotated[list[Path] | None, INTERFACE_DIR]
Uid = Annotated[str, typer.Argument(metavar="TYPE::ID", help="The interface.")]
Globs = Annotated[
    list[str], typer.Argument(metavar="GLOB...", help="TYPE or TYPE::ID, with the shell patterns *, ?, [].")
]
AsJson = Annotated[bool, typer.Option("--json", help="print JSON")]


def connect(url: str, interface_dirs: Sequence[Path] | None) -> BlackBoard:
    """Open the blackboard at ``url``.

    :raises CxbridgeError: when nobody is there, or the URL makes no sense.
    """
    from cxbridge.blackboard.urls import open_blackboard
    from cxbridge.clock import RealClock
    from cxbridge.interfaces.registry import InterfaceRegistry

    return open_blackboard(url, InterfaceRegistry(interface_dirs or ()), RealClock())


def split_glob(text: str) -> tuple[str, str]:
    """Split ``TYPE::ID``; a missing part is ``*``."""
    type_glob, _, id_glob = text.partition("::")
    return type_glob or "*", id_glob or "*"
