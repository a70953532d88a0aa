"""The transports that open blackboards by URL: a local blackboard, or a daemon's over ZeroMQ.

The scheme of the URL selects a row of :data:`TRANSPORTS`, to which plug-ins add transports.
"""

from __future__ import annotations

from typing import Any, Final

from cxbridge.blackboard.base import BlackBoard, Registry
from cxbridge.blackboard.kit.transport import BadUrlError, Transport
from cxbridge.clock import Clock
from cxbridge.events import EventBus
from cxbridge.plugins import Row, Table, package_hint

__all__ = ["TRANSPORTS", "BadUrlError", "find_transport", "open_blackboard"]

_ZMQ_TARGET = "cxbridge.blackboard.zmq.transport:ZmqTransport"


def _is_transport(loaded: object) -> bool:
    return isinstance(loaded, type) and issubclass(loaded, Transport)


TRANSPORTS: Final[Table[type[Transport]]] = Table(
    "TRANSPORTS",
    _is_transport,
    "a subclass of cxbridge.blackboard.kit.transport.Transport",
    Row("local", "cxbridge.blackboard.local:LocalTransport"),
    Row("tcp", _ZMQ_TARGET),
    Row("ipc", _ZMQ_TARGET),
)
"""The transports by URL scheme."""


def find_transport(url: str) -> Transport:
    """Return the transport for a URL.

    :raises BadUrlError: if no transport has the URL's scheme.
    :raises PluginError: if the transport of a plug-in cannot be loaded.
    """
    scheme, colon, _ = url.partition(":")
    # not by `TRANSPORTS.find`, whose error would name the scheme instead of the URL
    row = next((row for row in TRANSPORTS.rows if row.name == scheme.lower()), None)
    if not colon or row is None:
        prefixes = ", ".join("local:" if row.name == "local" else f"{row.name}://" for row in TRANSPORTS.rows)
        raise BadUrlError(
            f"'{url}' is not a blackboard's URL",
            hint=package_hint(f"{scheme}://") or f"a URL must start with one of {prefixes}",
        )
    return TRANSPORTS.load_target(row)()


def open_blackboard(
    url: str, registry: Registry, clock: Clock, bus: EventBus | None = None, **options: Any
) -> BlackBoard:
    """Return the blackboard at ``url``, connected.

    :param url: ``local:``, ``tcp://host:port``, ``ipc://path``, or a URL of a plug-in,
        optionally with the query that the transport's ``read_query`` defines.
    :param registry: returns the classes of types that are named by a string.
    :param bus: gets log lines; from a local blackboard, also writes.
    :param options: further arguments of the transport's blackboard class, see e.g.
        :class:`cxbridge.blackboard.zmq.ZmqBlackBoard`.
    :raises BadUrlError: if no transport has the scheme.
    :raises PluginError: if the transport of a plug-in cannot be loaded.
    :raises BlackBoardError: if the URL is invalid, or no server replies.
    """
    address, separator, query = url.partition("?")
    transport = find_transport(address)
    if separator:
        options |= transport.read_query(url, query)
    return transport.open(address, registry, clock, bus, **options)
