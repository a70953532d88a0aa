"""Errors of transports.

::

    BlackBoardError
    └── TransportError
        ├── DisconnectedError      the connection is lost
        ├── RequestTimeoutError    no reply in time
        ├── RemoteRefusalError     the peer refuses for a reason without error class
        ├── ProtocolError          invalid bytes
        └── EndpointError          an endpoint cannot be used
            └── InsecureEndpointError
"""

from __future__ import annotations

from cxbridge.errors import BlackBoardError


class TransportError(BlackBoardError):
    """The communication between client and server failed."""


class DisconnectedError(TransportError):
    """The client has no connection to the server, or the connection ended before the reply."""


class RequestTimeoutError(TransportError):
    """No reply came in time; the server may still carry out the request."""


class RemoteRefusalError(TransportError):
    """The peer refuses for a reason that has no error class, or without a reason."""


class ProtocolError(TransportError):
    """The bytes do not belong to this version of the protocol, or exceed a limit."""


class EndpointError(TransportError):
    """An endpoint is invalid, or cannot be bound or connected to."""


class InsecureEndpointError(EndpointError):
    """An endpoint that other machines can reach has no keys."""
