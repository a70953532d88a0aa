"""Blackboards by URL as commands and configurations spell them: keys, risks and patience in its query.

``tcp://robot:1911?key=mine.key_secret&server-key=robot.key``, or ``tcp://robot:1911?insecure=yes``, or
``fawkes://robot:1910?timeout=2&silence=2``.
"""

from __future__ import annotations

from math import inf
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
_LONGEST_S = 86_400.0


def open_board(url: str, registry: Registry, clock: Clock, bus: EventBus | None = None) -> BlackBoard:
    """Open the blackboard at ``url``; imports the transport that it takes.

    :raises BlackBoardError: when the URL makes no sense, or nobody answers.
    """
    # a transport, for those who use it: start-up time is a feature
    from cxbridge.blackboard.urls import open_blackboard  # noqa: PLC0415

    address, mark, query = url.partition("?")
    return open_blackboard(address, registry, clock, bus, **(_options(url, query) if mark else {}))


def _options(url: str, query: str) -> dict[str, Any]:
    """Return the options that a query stands for.

    :raises BlackBoardError: when it makes no sense.
    """
    return (_patience if url.startswith("fawkes://") else _security)(url, query)


def _patience(url: str, query: str) -> dict[str, Any]:
    """Return the seconds that a query for a Fawkes gives.

    :raises BlackBoardError: when it has something else.
    """
    given = dict(parse_qsl(query, keep_blank_values=True))
    try:
        seconds = {name: float(text) for name, text in given.items()}
    except ValueError:
        seconds = {"": 0.0}
    least = {"timeout": 0.01, "silence": 0.0}
    if not all(least.get(name, inf) <= value <= _LONGEST_S for name, value in seconds.items()):
        raise BlackBoardError(
            f"'{url}' has a query that makes no sense",
            hint="write fawkes://HOST:PORT?timeout=SECONDS&silence=SECONDS, either or both, at most a day",
        )
    return seconds


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
