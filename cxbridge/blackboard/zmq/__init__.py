"""The blackboard over ZeroMQ: a server for a local blackboard, and clients; docs/protocol-zmq.md.

::

    with ZmqBlackBoardServer(LocalBlackBoard(registry, clock), ["ipc:///run/user/1000/cxbridge"]) as server:
        ...

    board = ZmqBlackBoard("ipc:///run/user/1000/cxbridge", registry, clock)    # another process
"""

from __future__ import annotations

from typing import Any

from cxbridge.blackboard.base import Registry
from cxbridge.blackboard.zmq.client.board import ZmqBlackBoard
from cxbridge.blackboard.zmq.security import CurveClient, CurveServer
from cxbridge.blackboard.zmq.server.server import ZmqBlackBoardServer
from cxbridge.clock import Clock
from cxbridge.events import EventBus

__all__ = ["CurveClient", "CurveServer", "ZmqBlackBoard", "ZmqBlackBoardServer", "open_zmq"]


def open_zmq(
    url: str, registry: Registry, clock: Clock, bus: EventBus | None = None, **options: Any
) -> ZmqBlackBoard:
    """Return the blackboard at a ZeroMQ endpoint, for :func:`cxbridge.blackboard.urls.open_blackboard`.

    :param options: those of :class:`ZmqBlackBoard`.
    """
    return ZmqBlackBoard(url, registry, clock, bus, **options)
