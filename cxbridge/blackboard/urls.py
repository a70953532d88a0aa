"""A blackboard by its URL: in this process, over ZeroMQ, or a Fawkes'; code that uses it cannot tell."""

from __future__ import annotations

from importlib import import_module
from typing import Any, Final

from cxbridge.blackboard.base import BlackBoard, Registry
from cxbridge.blackboard.kit.transport import BadUrlError, Transport
from cxbridge.clock import Clock
from cxbridge.events import EventBus

__all__ = ["TRANSPORTS", "BadUrlError", "open_blackboard", "transport_of"]

TRANSPORTS: Final = {
    "local": "cxbridge.blackboard.local:LocalTransport",
    "tcp": "cxbridge.blackboard.zmq.transport:ZmqTransport",
    "ipc": "cxbridge.blackboard.zmq.transport:ZmqTransport",
    "inproc": "cxbridge.blackboard.zmq.transport:ZmqTransport",
    "fawkes": "cxbridge.blackboard.fawkesnet.transport:FawkesTransport",
}
"""``module:Class`` of the :class:`~cxbridge.blackboard.kit.transport.Transport` for each scheme.

Imported when it is asked for.
"""


def transport_of(url: str) -> Transport:
    """Return the transport for a URL.

    :raises BadUrlError: when there is none of this scheme.
    """
    scheme, colon, _ = url.partition(":")
    target = TRANSPORTS.get(scheme.lower())
    if not colon or target is None:
        known = ", ".join(f"{name}:" if name == "local" else f"{name}://" for name in TRANSPORTS)
        raise BadUrlError(f"'{url}' names no blackboard", hint=f"it starts with one of {known}")
    module, _, name = target.partition(":")
    transport = getattr(import_module(module), name)()
    assert isinstance(transport, Transport), f"{target} is not a transport"
    return transport


def open_blackboard(
    url: str, registry: Registry, clock: Clock, bus: EventBus | None = None, **options: Any
) -> BlackBoard:
    """Return the blackboard at ``url``, connected.

    :param url: ``local:``, ``tcp://host:port``, ``ipc://path``, ``inproc://name`` or ``fawkes://host:port``;
        ``?`` and options may follow, as the transport's ``read_query`` has them.
    :param registry: gives the classes of types that are named by a string.
    :param clock: gives time stamps.
    :param bus: gets log lines.
    :param options: what the transport takes besides, see e.g. :class:`cxbridge.blackboard.zmq.ZmqBlackBoard`.
    :raises BadUrlError: when there is no transport of this scheme.
    :raises BlackBoardError: when the URL makes no sense, or nobody answers.
    """
    address, mark, query = url.partition("?")
    transport = transport_of(address)
    if mark:
        options |= transport.read_query(url, query)
    return transport.open(address, registry, clock, bus, **options)
