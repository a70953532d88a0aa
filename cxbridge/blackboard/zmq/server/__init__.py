"""The server's side of the ZeroMQ transport.

One thread owns all sockets, sessions and channels: that of :class:`.server.ZmqBlackBoardServer`. Other
threads of the process reach it through ``post`` alone; listeners of the local blackboard do so when they are
called in the thread of a local writer.
"""

from cxbridge.blackboard.zmq.server.server import MOST_CONNECTIONS, ZmqBlackBoardServer

__all__ = ["MOST_CONNECTIONS", "ZmqBlackBoardServer"]
