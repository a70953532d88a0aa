"""The server of a daemon for Fawkes' tools, with plugin manager, configuration and network logger."""

from __future__ import annotations

from dataclasses import replace

from cxbridge.blackboard.fawkesnet.components.configuration import ConfigurationComponent
from cxbridge.blackboard.fawkesnet.components.logger import NetworkLogger
from cxbridge.blackboard.fawkesnet.components.plugins import PluginManager
from cxbridge.blackboard.fawkesnet.server import DEFAULT_LIMITS, FawkesServer
from cxbridge.daemon.plugins import DaemonPlugins
from cxbridge.daemon.servers.server import ServerComponent
from cxbridge.process.file_limit import most_clients, raise_file_limit
from cxbridge.rights import Right


class FawkesComponent(ServerComponent[FawkesServer]):
    """Serves the blackboard over Fawkes' own protocol."""

    def make(self) -> FawkesServer:
        """Make the server."""
        daemon = self._daemon
        settings, rights = daemon.settings.fawkes, daemon.settings.rights
        assert settings is not None  # else it is not needed
        plugins = daemon.plugins = DaemonPlugins(daemon.lifecycle, allowed=rights.allow(Right.CONTROL))
        manager = plugins.watchers = PluginManager(plugins, daemon.log.warn)
        components = (
            manager,
            ConfigurationComponent(daemon.config, writable=rights.allow(Right.PROGRAMS)),
            NetworkLogger(daemon.bus),
        )
        clients = most_clients(raise_file_limit(), DEFAULT_LIMITS.most_clients)
        return FawkesServer(
            daemon.board,
            settings.host,
            settings.port,
            bus=daemon.bus,
            components=components,
            allow=settings.allow,
            rights=rights,
            limits=replace(DEFAULT_LIMITS, most_clients=clients),
        )

    def endpoints(self, server: FawkesServer) -> list[str]:
        """Return the URL, with the port that was free."""
        host = f"[{server.host}]" if ":" in server.host else server.host
        return [f"fawkes://{host}:{server.port}"]
