"""The servers of a daemon: ZeroMQ, and Fawkes' protocol for Fawkes' tools."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, Protocol, TypeVar

from cxbridge.blackboard.fawkesnet.components.configuration import ConfigurationComponent
from cxbridge.blackboard.fawkesnet.components.logger import NetworkLogger
from cxbridge.blackboard.fawkesnet.components.plugins import PluginManager
from cxbridge.blackboard.fawkesnet.server import FawkesServer
from cxbridge.blackboard.zmq.security import CurveServer
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.plugins import DaemonPlugins
from cxbridge.daemon.process import raise_file_limit
from cxbridge.rights import Right
from cxbridge.run.components.component import Component


class Server(Protocol):
    """A server with its own threads."""

    def start(self) -> None:
        """Start serving."""

    def stop(self) -> None:
        """Stop serving and release the resources."""


ServerType = TypeVar("ServerType", bound=Server)


class ServerComponent(Component, ABC, Generic[ServerType]):
    """Makes and starts a server on activation; the server continues while other components are paused."""

    steady = True

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon
        self._server: ServerType | None = None

    @abstractmethod
    def make(self) -> ServerType:
        """Make the server."""

    @abstractmethod
    def endpoints(self, server: ServerType) -> list[str]:
        """Return the URLs of a started server."""

    def activate(self) -> None:
        server = self.make()
        try:
            server.start()
        except Exception:
            server.stop()  # one of several endpoints may be open
            raise
        self._server = server
        self._daemon.add_endpoints(self.endpoints(server))

    def deactivate(self) -> None:
        server, self._server = self._server, None
        if server is not None:
            server.stop()


class ZmqComponent(ServerComponent[ZmqBlackBoardServer]):
    """Serves the blackboard over ZeroMQ."""

    def make(self) -> ZmqBlackBoardServer:
        """Make the server, with CURVE if there are keys."""
        raise_file_limit()
        settings, keys = self._daemon.settings, None
        if settings.secret_key is not None and settings.clients is not None:
            keys = CurveServer(settings.secret_key, settings.clients)
        return ZmqBlackBoardServer(
            self._daemon.board,
            list(settings.endpoints),
            keys=keys,
            insecure=settings.insecure,
            rights=settings.rights,
        )

    def endpoints(self, server: ZmqBlackBoardServer) -> list[str]:
        """Return the URLs with their actual ports."""
        return server.endpoints


class FawkesComponent(ServerComponent[FawkesServer]):
    """Serves the blackboard over Fawkes' protocol."""

    def make(self) -> FawkesServer:
        """Make the server."""
        raise_file_limit()
        daemon = self._daemon
        settings, rights = daemon.settings.fawkes, daemon.settings.rights
        assert settings is not None  # the table makes this component only with these settings
        plugins = daemon.plugins = DaemonPlugins(daemon.lifecycle, allowed=rights.allow(Right.CONTROL))
        manager = plugins.watchers = PluginManager(plugins, daemon.log.warn)
        components = (
            manager,
            ConfigurationComponent(daemon.config, writable=rights.allow(Right.PROGRAMS)),
            NetworkLogger(daemon.bus),
        )
        return FawkesServer(
            daemon.board,
            settings.host,
            settings.port,
            bus=daemon.bus,
            components=components,
            allow=settings.allow,
            rights=rights,
        )

    def endpoints(self, server: FawkesServer) -> list[str]:
        """Return the URL with its actual port."""
        host = f"[{server.host}]" if ":" in server.host else server.host
        return [f"fawkes://{host}:{server.port}"]
