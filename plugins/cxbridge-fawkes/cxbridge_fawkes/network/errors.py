"""Errors of Fawkes' network protocol, in addition to :mod:`cxbridge.blackboard.kit.errors`."""

from __future__ import annotations

from cxbridge.blackboard.kit.errors import DisconnectedError, ProtocolError


class FrameTooLongError(ProtocolError):
    """A frame's header announces more bytes than permitted.

    :param component: the number of the component.
    :param kind: the number of the message within its component.
    :param size: the announced number of bytes.
    :param limit: the permitted number of bytes.
    """

    def __init__(self, component: int, kind: int, size: int, limit: int) -> None:
        super().__init__(
            f"a message {kind} of component {component} announces {size} bytes, but only {limit} are allowed"
        )


class MalformedMessageError(ProtocolError):
    """A message contains invalid bytes."""


class UnreachableError(DisconnectedError):
    """No server replies at the address."""

    def __init__(self, address: str, reason: str) -> None:
        super().__init__(
            f"no Fawkes answers at {address}: {reason}",
            hint="is it running, and is its network enabled (port 1910 unless configured)?",
        )


class ConnectionLostError(DisconnectedError):
    """The connection is lost, and the client is reconnecting unless its blackboard was shut down."""

    def __init__(self, address: str, reason: str) -> None:
        super().__init__(f"the connection to the Fawkes at {address} is lost: {reason}")
