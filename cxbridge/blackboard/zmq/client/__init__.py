"""The client of the ZeroMQ transport.

The modules and their threads:

- :mod:`.board`: the public blackboard, callable from any thread, without state of the session.

- :mod:`.interfaces`: the open instances and their copies, and the effect of each frame on them. Its lock
  guards the tables.

- :mod:`.port`: the copy of one interface, with its lock.

- :mod:`.sending`: the commands socket and the pending requests, for any thread that holds its lock.

- :mod:`.receiving`: the events socket and the thread that calls listeners. The thread whose turn it is
  receives.

- :mod:`.session`: the thread that connects, keeps the session alive and reconnects.

Order of locks: interfaces, sending, receiving, port. No lock is held while listeners run.
"""

from cxbridge.blackboard.zmq.client.board import ZmqBlackBoard

__all__ = ["ZmqBlackBoard"]
