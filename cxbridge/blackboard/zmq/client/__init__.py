"""The client's side of the ZeroMQ transport.

The modules, and the threads that run in them:

- :mod:`.board`: the public blackboard. Any thread calls it; it keeps no state of the session.
- :mod:`.interfaces`: all open instances and their copies, and what each frame of the server does to them. Its
  lock guards the tables.
- :mod:`.port`: the copy of one interface, with its lock.
- :mod:`.sending`: the commands socket and the requests under way. Any thread, one at a time, by its lock.
- :mod:`.receiving`: the events socket and the thread that calls listeners. The thread whose turn it is
  receives.
- :mod:`.session`: the thread that connects, keeps the session alive and begins again when it is lost.

Locks are taken in this order: interfaces, sending, receiving, port. No lock is held while listeners run.
"""

from cxbridge.blackboard.zmq.client.board import ZmqBlackBoard

__all__ = ["ZmqBlackBoard"]
