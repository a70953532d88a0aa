"""Errors of Fawkes' network protocol; the rest is in :mod:`cxbridge.blackboard.kit.errors`."""

from __future__ import annotations

from cxbridge.blackboard.kit.errors import DisconnectedError, ProtocolError


class FrameTooLongError(ProtocolError):
    """A header announces more bytes than a message of its kind can have.

    :param component: of the frame.
    :param kind: of the message.
    :param size: announced bytes.
    :param limit: allowed bytes.
    """

    def __init__(self, component: int, kind: int, size: int, limit: int) -> None:
        super().__init__(
            f"a message {kind} of component {component} announces {size} bytes, allowed are {limit}"
        )


class MalformedMessageError(ProtocolError):
    """A message with invalid bytes."""


class UnreachableError(DisconnectedError):
    """No server answers at the address."""

    def __init__(self, address: str, reason: str) -> None:
        super().__init__(
            f"no Fawkes answers at {address}: {reason}",
            hint="is it running, and is its network enabled (port 1910 unless configured)?",
        )


class ConnectionLostError(DisconnectedError):
    """The connection is lost; the client is trying to get it back."""

    def __init__(self, address: str, reason: str) -> None:
        super().__init__(f"the connection to the Fawkes at {address} is lost: {reason}")
