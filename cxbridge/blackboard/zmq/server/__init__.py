"""The server of the ZeroMQ transport.

One thread owns all sockets, sessions and channels. Other threads reach it only through ``post``, among them
the listeners that local writers call.
"""

from cxbridge.blackboard.zmq.server.server import ZmqBlackBoardServer

__all__ = ["ZmqBlackBoardServer"]
