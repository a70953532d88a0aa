"""Blackboards by URL as commands and configurations spell them: keys and risks in its query.

``tcp://robot:1911?key=mine.key_secret&server-key=robot.key``, or ``tcp://robot:1911?insecure=yes``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.base import Registry
from cxbridge.clock import Clock
from cxbridge.errors import BlackBoardError
from cxbridge.events import EventBus

_KEYS = ("key", "server-key")
_YES = ("yes", "true", "1")


def open_board(url: str, registry: Registry, clock: Clock, bus: EventBus | None = None) -> BlackBoard:
    """Open the blackboard at ``url``; imports the transport that it takes.

    :raises BlackBoardError: when the URL makes no sense, or nobody answers.
    """
    # a transport, for those who use it: start-up time is a feature
    from cxbridge.blackboard.urls import open_blackboard  # noqa: PLC0415

    address, mark, query = url.partition("?")
    return open_blackboard(address, registry, clock, bus, **(_security(url, query) if mark else {}))


def _security(url: str, query: str) -> dict[str, Any]:
    """Return the options that a query stands for.

    :raises BlackBoardError: when it has something else, or one key only.
    """
    hint = "write tcp://HOST:PORT?key=FILE&server-key=FILE, or tcp://HOST:PORT?insecure=yes"
    if not url.startswith("tcp://"):
        raise BlackBoardError(f"'{url}' takes no '?{query}'", hint=hint)
    given = dict(parse_qsl(query, keep_blank_values=True))
    insecure = given.pop("insecure", "no").lower() in _YES
    if given and sorted(given) != sorted(_KEYS):
        raise BlackBoardError(f"'{url}' needs both keys, and nothing else", hint=hint)
    if not given:
        return {"insecure": insecure}

    from cxbridge.blackboard.zmq.security import CurveClient  # noqa: PLC0415 - see open_board

    secret_key, server_key = (Path(given[name]) for name in _KEYS)
    return {"insecure": insecure, "keys": CurveClient(secret_key, server_key)}
