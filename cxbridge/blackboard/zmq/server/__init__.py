"""The server of the ZeroMQ transport.

One thread owns all sockets, sessions and channels. Other threads, such as local writers that call the
server's listeners, only post calls to that thread.
"""

from cxbridge.blackboard.zmq.server.server import ZmqBlackBoardServer

__all__ = ["ZmqBlackBoardServer"]
