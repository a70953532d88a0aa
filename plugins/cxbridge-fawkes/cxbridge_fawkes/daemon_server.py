"""The component of a daemon that serves its blackboard over Fawkes' protocol."""

from __future__ import annotations

from cxbridge.daemon.daemon import Daemon
from cxbridge.listening import url_host
from cxbridge.run.components.component import Component
from cxbridge_fawkes.network.components.configuration import ConfigurationComponent
from cxbridge_fawkes.network.components.logger import NetworkLogger
from cxbridge_fawkes.network.components.plugins import PluginManager
from cxbridge_fawkes.network.server import FawkesServer
from cxbridge_fawkes.settings import FawkesSettings


class FawkesServerComponent(Component):
    """Serves the daemon's blackboard, configuration, log and list of components to Fawkes' tools."""

    steady = True  # clients cannot stop the server that serves them

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon

    def activate(self) -> None:
        # a new server for each activation, because a stopped server cannot start again
        daemon = self._daemon
        settings = daemon.section("fawkes")
        assert isinstance(settings, FawkesSettings)
        components = (
            PluginManager(daemon.lifecycle.list_changeable),
            ConfigurationComponent(daemon.config),
            NetworkLogger(daemon.bus),
        )
        self._server = server = FawkesServer(
            daemon.board,
            settings.host,
            settings.port,
            bus=daemon.bus,
            components=components,
            allow=settings.allow,
            rights=daemon.rights,
        )
        server.start()
        daemon.add_endpoints([f"fawkes://{url_host(server.host)}:{server.port}"])

    def deactivate(self) -> None:
        self._server.stop()
