"""The base of the components of the server."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from cxbridge.blackboard.fawkesnet.messages.frames import ComponentId, FawkesFrame
from cxbridge.blackboard.fawkesnet.session import FawkesNetworkHub, FawkesSession


class NetworkHandler(ABC):
    """Answers the frames for one component.

    All methods are called in the server's thread.
    """

    COMPONENT: ClassVar[ComponentId]

    def start(self, hub: FawkesNetworkHub) -> None:  # noqa: B027 - not everybody has something to prepare
        """Prepare for clients."""

    @abstractmethod
    def handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        """Carry out the request of a client.

        :raises CxbridgeError: when the request is invalid; the server logs it.
        """

    def disconnected(self, session: FawkesSession) -> None:  # noqa: B027 - not everybody remembers clients
        """Forget a client."""

    def stop(self) -> None:  # noqa: B027 - not everybody has something to end
        """End; there are no clients any more."""
