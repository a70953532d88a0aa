"""The base class of components that serve the blackboard in threads of their own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, Protocol, TypeVar

from cxbridge.daemon.daemon import Daemon
from cxbridge.run.components.component import Component


class Server(Protocol):
    """Serves in a thread of its own."""

    def start(self) -> None:
        """Begin to serve."""

    def stop(self) -> None:
        """Serve no more, and release everything."""


ServerType = TypeVar("ServerType", bound=Server)


class ServerComponent(Component, ABC, Generic[ServerType]):
    """A server, that is made and started when it is activated, and goes on while others are paused."""

    steady = True

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon
        self._server: ServerType | None = None

    @abstractmethod
    def make(self) -> ServerType:
        """Make the server."""

    @abstractmethod
    def endpoints(self, server: ServerType) -> list[str]:
        """Return the URLs of a server that has started."""

    def activate(self) -> None:
        """Begin to serve."""
        server = self.make()
        try:
            server.start()
        except Exception:
            server.stop()
            raise
        self._server = server
        self._daemon.add_endpoints(self.endpoints(server))

    def deactivate(self) -> None:
        """Serve no more."""
        server, self._server = self._server, None
        if server is not None:
            server.stop()
