"""A blackboard by its URL: in this process, over ZeroMQ, or a Fawkes'; code that uses it cannot tell."""

from __future__ import annotations

from importlib import import_module
from typing import Any, Final, cast

from cxbridge.blackboard.base import BlackBoard, Registry
from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.clock import Clock
from cxbridge.events import EventBus

TRANSPORTS: Final = {
    "local": "cxbridge.blackboard.urls:open_local",
    "tcp": "cxbridge.blackboard.zmq:open_zmq",
    "ipc": "cxbridge.blackboard.zmq:open_zmq",
    "inproc": "cxbridge.blackboard.zmq:open_zmq",
    "fawkes": "cxbridge.blackboard.fawkesnet:open_fawkes",
}
"""``module:function`` for each scheme, imported when it is asked for."""


class BadUrlError(BlackBoardError):
    """The URL names no blackboard."""


def open_blackboard(
    url: str, registry: Registry, clock: Clock, bus: EventBus | None = None, **options: Any
) -> BlackBoard:
    """Return the blackboard at ``url``, connected.

    :param url: ``local:``, ``tcp://host:port``, ``ipc://path``, ``inproc://name`` or ``fawkes://host:port``.
    :param registry: gives the classes of types that are named by a string.
    :param clock: gives time stamps.
    :param bus: gets log lines.
    :param options: what the transport takes besides, see e.g. :class:`cxbridge.blackboard.zmq.ZmqBlackBoard`.
    :raises BadUrlError: when there is no transport of this scheme.
    :raises BlackBoardError: when nobody answers.
    """
    scheme, colon, _ = url.partition(":")
    target = TRANSPORTS.get(scheme.lower())
    if not colon or target is None:
        known = ", ".join(f"{name}:" if name == "local" else f"{name}://" for name in TRANSPORTS)
        raise BadUrlError(f"'{url}' names no blackboard", hint=f"it starts with one of {known}")
    module, _, function = target.partition(":")
    opener = getattr(import_module(module), function)
    return cast("BlackBoard", opener(url, registry, clock, bus, **options))


def open_local(url: str, registry: Registry, clock: Clock, bus: EventBus | None = None) -> BlackBoard:
    """Return a new, empty blackboard in this process.

    :raises BadUrlError: when the URL is more than ``local:``.
    """
    from cxbridge.blackboard.local import LocalBlackBoard  # noqa: PLC0415 - not needed for remote ones

    if url.partition(":")[2].strip("/"):
        raise BadUrlError(f"'{url}' has more than a local blackboard needs", hint="write local:")
    return LocalBlackBoard(registry, clock, bus)
