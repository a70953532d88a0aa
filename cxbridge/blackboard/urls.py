"""A blackboard by its URL: in this process, over ZeroMQ, or a Fawkes'; code that uses it cannot tell."""

from __future__ import annotations

from typing import Any, Final

from cxbridge.blackboard.base import BlackBoard, Registry
from cxbridge.blackboard.kit.transport import BadUrlError, Transport
from cxbridge.clock import Clock
from cxbridge.events import EventBus
from cxbridge.plugins import Row, Table

__all__ = ["TRANSPORTS", "BadUrlError", "open_blackboard", "transport_of"]

_ZMQ = "cxbridge.blackboard.zmq.transport:ZmqTransport"


def _is_transport(loaded: object) -> bool:
    return isinstance(loaded, type) and issubclass(loaded, Transport)


TRANSPORTS: Final[Table[type[Transport]]] = Table(
    "TRANSPORTS",
    _is_transport,
    "a subclass of cxbridge.blackboard.kit.transport.Transport",
    Row("local", "cxbridge.blackboard.local:LocalTransport"),
    Row("tcp", _ZMQ),
    Row("ipc", _ZMQ),
    Row("inproc", _ZMQ),
    Row("fawkes", "cxbridge.blackboard.fawkesnet.transport:FawkesTransport"),
)
"""The transports by the schemes of their URLs."""


def transport_of(url: str) -> Transport:
    """Return the transport for a URL.

    :raises BadUrlError: when no transport has the URL's scheme.
    """
    scheme, colon, _ = url.partition(":")
    row = next((row for row in TRANSPORTS.rows if row.name == scheme.lower()), None)
    if not colon or row is None:
        known = ", ".join("local:" if row.name == "local" else f"{row.name}://" for row in TRANSPORTS.rows)
        raise BadUrlError(f"'{url}' names no blackboard", hint=f"it starts with one of {known}")
    return TRANSPORTS.load(row)()


def open_blackboard(
    url: str, registry: Registry, clock: Clock, bus: EventBus | None = None, **options: Any
) -> BlackBoard:
    """Return the blackboard at ``url``, connected.

    :param url: ``local:``, ``tcp://host:port``, ``ipc://path``, ``inproc://name`` or ``fawkes://host:port``;
        ``?`` and options may follow, as the transport's ``read_query`` has them.
    :param registry: gives the classes of types that are named by a string.
    :param clock: gives time stamps.
    :param bus: gets log lines.
    :param options: further options of the transport, see e.g. :class:`cxbridge.blackboard.zmq.ZmqBlackBoard`.
    :raises BadUrlError: when there is no transport of this scheme.
    :raises BlackBoardError: when the URL is invalid, or no server answers.
    """
    address, mark, query = url.partition("?")
    transport = transport_of(address)
    if mark:
        options |= transport.read_query(url, query)
    return transport.open(address, registry, clock, bus, **options)
