"""Fawkes' network protocol: a client of Fawkes' blackboard, and a server for Fawkes' tools.

::

    board = open_fawkes("fawkes://robot:1910", registry, clock)
    with FawkesServer(local_board, port=1910): ...

docs/evidence/protocol-fawkes.md describes the protocol.
"""

from __future__ import annotations

from cxbridge.blackboard.base import BlackBoard, Registry
from cxbridge.clock import Clock
from cxbridge.events import EventBus

__all__ = ["open_fawkes"]


def open_fawkes(
    url: str,
    registry: Registry,
    clock: Clock,
    bus: EventBus | None = None,
    *,
    timeout: float = 5.0,
    silence: float = 5.0,
) -> BlackBoard:
    """Connect to the blackboard of Fawkes at ``fawkes://host:port``.

    :param registry: returns the classes of types that are named by a string.
    :param clock: the source of the time stamps of local writes.
    :param bus: gets log lines and the writes of open interfaces.
    :param timeout: seconds for connecting and for replies.
    :param silence: seconds of silence before the server is probed; 0 turns probes off.
    :raises BlackBoardError: if the URL is invalid or no server replies.
    """
    from cxbridge.blackboard.fawkesnet.client.board import FawkesBlackBoard  # noqa: PLC0415 - servers do not need the client

    return FawkesBlackBoard(url, registry, clock, bus, timeout=timeout, silence=silence)
