"""The client side of Fawkes' network protocol.

There are four kinds of threads: callers; the receiver of :mod:`.connection`, which runs :mod:`.receiver` and
ends with its connection; the dispatcher, which calls listeners; and the thread of :mod:`.reconnecting`, which
handles a lost or silent connection.
"""

from cxbridge.blackboard.fawkesnet.client.board import FawkesBlackBoard

__all__ = ["FawkesBlackBoard"]
