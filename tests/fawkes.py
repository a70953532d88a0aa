"""Fawkes' protocol in the core's tests, where the plug-in cxbridge-fawkes is installed."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

from cxbridge.blackboard import BlackBoard

HAS_FAWKES = find_spec("cxbridge_fawkes") is not None

TRANSPORT: tuple[str, ...] = ("fawkes",) if HAS_FAWKES else ()
"""The name of the transport."""

NO_SERVER: tuple[str, ...] = ("--no-fawkes",) if HAS_FAWKES else ()
"""The option of a daemon that does not serve Fawkes' tools: two of them cannot have the port 1910."""

ANY_PORT: tuple[tuple[str, Any], ...] = (("fawkes/port", 0),) if HAS_FAWKES else ()
"""The setting of a daemon that serves Fawkes' tools, if the plug-in is installed."""


def fawkes_server(board: BlackBoard, port: int = 0) -> Any:
    """Return a server of Fawkes' protocol."""
    from cxbridge_fawkes.network.server import FawkesServer

    return FawkesServer(board, port=port)
