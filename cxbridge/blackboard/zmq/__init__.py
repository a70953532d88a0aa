"""The blackboard over ZeroMQ: server and clients, see docs/evidence/protocol-zmq.md.

::

    with ZmqBlackBoardServer(LocalBlackBoard(registry, clock), ["ipc:///run/user/1000/cxbridge"]) as server:
        ...
    board = ZmqBlackBoard("ipc:///run/user/1000/cxbridge", registry, clock)    # another process
"""

from __future__ import annotations

from cxbridge.blackboard.zmq.client.board import ZmqBlackBoard
from cxbridge.blackboard.zmq.security import CurveClient, CurveServer
from cxbridge.blackboard.zmq.server.server import ZmqBlackBoardServer

__all__ = ["CurveClient", "CurveServer", "ZmqBlackBoard", "ZmqBlackBoardServer"]
