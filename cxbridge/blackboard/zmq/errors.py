"""What can go wrong between a client and a server; the rest is in :mod:`cxbridge.blackboard.errors`.

::

    BlackBoardError
     └── TransportError
          ├── DisconnectedError      there is no session with the server
          ├── RequestTimeoutError    no answer in time
          ├── RefusedError           the server refuses, for a reason of its own
          ├── ProtocolError          a frame makes no sense
          └── EndpointError          an endpoint cannot be used
               └── InsecureEndpointError
"""

from __future__ import annotations

from cxbridge.errors import BlackBoardError


class TransportError(BlackBoardError):
    """Something between a client and a server went wrong."""


class DisconnectedError(TransportError):
    """There is no session with the server, or it ended before the answer came."""


class RequestTimeoutError(TransportError):
    """No answer came in time; what was asked for may still happen."""


class RefusedError(TransportError):
    """The server refuses, for a reason that has no error of its own."""


class ProtocolError(TransportError):
    """A frame makes no sense: not of this protocol, of another version, or beyond a limit."""


class EndpointError(TransportError):
    """An endpoint cannot be bound or connected to, or is none."""


class InsecureEndpointError(EndpointError):
    """An endpoint beyond this machine was given without keys."""
