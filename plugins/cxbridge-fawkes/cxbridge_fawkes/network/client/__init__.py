"""The client side of Fawkes' network protocol.

The client has three threads besides those of its callers: the receiving thread of :mod:`.connection`, which
handles frames (:mod:`.receiver`) and ends with its connection; the dispatcher, which calls listeners; and the
thread of :mod:`.reconnecting`, which handles a lost or silent connection.
"""

from cxbridge_fawkes.network.client.board import FawkesBlackBoard

__all__ = ["FawkesBlackBoard"]
