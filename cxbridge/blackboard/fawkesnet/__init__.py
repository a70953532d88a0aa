"""Fawkes' own network protocol: a Fawkes as a blackboard, and our blackboard for Fawkes' tools.

::

    board = open_fawkes("fawkes://robot:1910", registry, clock)
    with FawkesServer(local_board, port=1910): ...

The protocol is described in docs/evidence/protocol-fawkes.md.
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
    """Connect to the Fawkes at ``fawkes://host:port``.

    :param registry: gives the classes of types that are named by a string.
    :param clock: gives the time stamps of local writes.
    :param bus: gets log lines, and the writes of interfaces that are open here.
    :param timeout: seconds to connect, and to wait for an answer.
    :param silence: seconds of silence after which the Fawkes is asked for a sign of life; 0: never.
    :raises BlackBoardError: when the URL is invalid or no server answers.
    """
    from cxbridge.blackboard.fawkesnet.client.board import FawkesBlackBoard  # noqa: PLC0415 - threads, sockets

    return FawkesBlackBoard(url, registry, clock, bus, timeout=timeout, silence=silence)
