"""Blackboards by URL as commands and configurations spell them: keys, risks and patience in its query.

``tcp://robot:1911?key=mine.key_secret&server-key=robot.key``, or ``tcp://robot:1911?insecure=yes``, or
``fawkes://robot:1910?timeout=2&silence=2``.
"""

from __future__ import annotations

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.base import Registry
from cxbridge.clock import Clock
from cxbridge.events import EventBus


def open_board(url: str, registry: Registry, clock: Clock, bus: EventBus | None = None) -> BlackBoard:
    """Open the blackboard at ``url``; imports the transport that it takes.

    :raises BlackBoardError: when the URL makes no sense, or nobody answers.
    """
    # a transport, for those who use it: start-up time is a feature
    from cxbridge.blackboard.urls import open_blackboard  # noqa: PLC0415

    return open_blackboard(url, registry, clock, bus)
