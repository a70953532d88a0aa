"""The components of a daemon that serve its blackboard: over ZeroMQ, and over Fawkes' protocol."""

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
    def make_server(self) -> ServerType:
        """Make the server."""

    @abstractmethod
    def list_endpoints(self, server: ServerType) -> list[str]:
        """Return the URLs of a started server."""

    def activate(self) -> None:
        server = self.make_server()  # anew each time, because a stopped server does not start again
        try:
            server.start()
        except Exception:
            server.stop()  # one of several endpoints may be open
            raise
        self._server = server
        self._daemon.add_endpoints(self.list_endpoints(server))

    def deactivate(self) -> None:
        server, self._server = self._server, None
        if server is not None:
            server.stop()


class ZmqComponent(ServerComponent[ZmqBlackBoardServer]):
    """Serves the blackboard over ZeroMQ."""

    def make_server(self) -> ZmqBlackBoardServer:
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

    def list_endpoints(self, server: ZmqBlackBoardServer) -> list[str]:
        """Return the URLs with their actual ports."""
        return server.endpoints


class FawkesComponent(ServerComponent[FawkesServer]):
    """Serves the blackboard over Fawkes' protocol."""

    def make_server(self) -> FawkesServer:
        """Make the server."""
        raise_file_limit()
        daemon = self._daemon
        settings, rights = daemon.settings.fawkes, daemon.settings.rights
        assert settings is not None  # the table makes this component only with these settings
        plugins = daemon.plugins = DaemonPlugins(daemon.lifecycle, may_change=rights.allow(Right.CONTROL))
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

    def list_endpoints(self, server: FawkesServer) -> list[str]:
        """Return the URL with its actual port."""
        host = f"[{server.host}]" if ":" in server.host else server.host
        return [f"fawkes://{host}:{server.port}"]
