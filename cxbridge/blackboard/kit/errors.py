"""Errors of transports.

::

    BlackBoardError
    └── TransportError
        ├── DisconnectedError      there is no connection, or it ended before the reply
        ├── RequestTimeoutError    no reply in time
        ├── RemoteRefusalError     the peer refuses for another reason
        ├── ProtocolError          invalid bytes
        └── EndpointError          an endpoint cannot be used
            └── InsecureEndpointError
"""

from __future__ import annotations

from cxbridge.errors import BlackBoardError


class TransportError(BlackBoardError):
    """The communication between client and server failed."""


class DisconnectedError(TransportError):
    """There is no connection to the server, or it ended before the reply."""


class RequestTimeoutError(TransportError):
    """No reply came in time; the request may still be carried out."""


class RemoteRefusalError(TransportError):
    """The peer refuses for a reason that has no error class, or without a reason."""


class ProtocolError(TransportError):
    """The bytes do not belong to this version of the protocol, or exceed a limit."""


class EndpointError(TransportError):
    """An endpoint is invalid, or cannot be bound or connected to."""


class InsecureEndpointError(EndpointError):
    """An endpoint that other machines can reach was given without keys."""
