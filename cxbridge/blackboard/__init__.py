"""The blackboard: interfaces with one writer and many readers, messages to the writer, events.

::

    board = LocalBlackBoard(registry, clock)
    with board.open_for_writing("SkillerInterface", "Skiller", owner="skiller") as skiller:
        skiller.skill_string = "say{}"
        skiller.write()
"""

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.listeners import EventKind, Listener, Observer, listening
from cxbridge.blackboard.local import LocalBlackBoard
from cxbridge.blackboard.names import parse_uid

__all__ = [
    "BlackBoard",
    "EventKind",
    "InterfaceInfo",
    "Listener",
    "LocalBlackBoard",
    "Observer",
    "listening",
    "parse_uid",
]
