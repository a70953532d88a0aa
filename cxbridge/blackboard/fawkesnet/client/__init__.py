"""The client's side of Fawkes' network protocol.

Four kinds of threads: callers; the receiver of :mod:`.connection`, which ends with its connection and runs
:mod:`.receiver`; the dispatcher, which calls listeners; and that of :mod:`.reconnecting`, which is at work
when a connection is lost or silent.
"""

from cxbridge.blackboard.fawkesnet.client.board import FawkesBlackBoard

__all__ = ["FawkesBlackBoard"]
