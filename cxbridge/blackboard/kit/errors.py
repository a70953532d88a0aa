"""Errors of transports; those that every blackboard raises are in :mod:`cxbridge.blackboard.errors`.

::

    BlackBoardError
     └── TransportError
          ├── DisconnectedError      there is no connection, or it ended before the answer came
          ├── RequestTimeoutError    no answer in time
          ├── RemoteRefusalError     the other end refuses, for another reason
          ├── ProtocolError          invalid bytes
          └── EndpointError          an endpoint cannot be used
               └── InsecureEndpointError
"""

from __future__ import annotations

from cxbridge.errors import BlackBoardError


class TransportError(BlackBoardError):
    """Something between a client and a server went wrong."""


class DisconnectedError(TransportError):
    """There is no connection to the server, or it ended before the answer came."""


class RequestTimeoutError(TransportError):
    """No answer came in time; the request may still be carried out."""


class RemoteRefusalError(TransportError):
    """The other end refuses, for a reason without an error class, or without a reason."""


class ProtocolError(TransportError):
    """Invalid bytes: not of this protocol, of another version, or beyond a limit."""


class EndpointError(TransportError):
    """An endpoint cannot be bound or connected to, or is none."""


class InsecureEndpointError(EndpointError):
    """An endpoint beyond this machine was given without keys."""
