"""The client of the ZeroMQ transport.

The modules and their threads:

- :mod:`.board`: the public blackboard, callable from any thread, without state of the session.

- :mod:`.interfaces`: the open instances and their copies, and the effect of each frame on them. A lock guards
  the tables.

- :mod:`.port`: the copy of one interface, with its lock.

- :mod:`.sending`: the commands socket and the pending requests, for any thread that holds the sender's lock.

- :mod:`.receiving`: the events socket and the thread that calls listeners, which takes turns in receiving
  with the thread of the session.

- :mod:`.session`: the thread that connects, keeps the session alive and reconnects.

A thread that needs several locks acquires them in the order interfaces, sending, receiving, port. No thread
holds a lock while listeners run.
"""

from cxbridge.blackboard.zmq.client.board import ZmqBlackBoard

__all__ = ["ZmqBlackBoard"]
