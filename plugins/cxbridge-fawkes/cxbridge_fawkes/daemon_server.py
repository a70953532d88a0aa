"""The component of a daemon that serves its blackboard over Fawkes' protocol."""

from __future__ import annotations

from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.process import raise_file_limit
from cxbridge.mainloop import Hook
from cxbridge.rights import Right
from cxbridge.run.components.component import Component
from cxbridge_fawkes.daemon_plugins import DaemonPlugins
from cxbridge_fawkes.network.components.configuration import ConfigurationComponent
from cxbridge_fawkes.network.components.logger import NetworkLogger
from cxbridge_fawkes.network.components.plugins import PluginManager
from cxbridge_fawkes.network.server import FawkesServer
from cxbridge_fawkes.settings import FawkesSettings


class FawkesComponent(Component):
    """Serves Fawkes' tools; the main loop carries out the requests of ``ffplugin``."""

    hooks = (Hook.PRE_LOOP,)
    steady = True  # clients cannot stop the server that serves them

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon

    def activate(self) -> None:
        # anew each time, because a stopped server does not start again
        raise_file_limit()
        daemon = self._daemon
        settings, rights = daemon.section("fawkes"), daemon.rights
        assert isinstance(settings, FawkesSettings)
        plugins = DaemonPlugins(daemon.lifecycle, may_change=rights.allow(Right.CONTROL))
        manager = plugins.watchers = PluginManager(plugins, daemon.log.warn)
        components = (
            manager,
            ConfigurationComponent(daemon.config, writable=rights.allow(Right.PROGRAMS)),
            NetworkLogger(daemon.bus),
        )
        server = FawkesServer(
            daemon.board,
            settings.host,
            settings.port,
            bus=daemon.bus,
            components=components,
            allow=settings.allow,
            rights=rights,
        )
        server.start()
        self._plugins, self._server = plugins, server
        host = f"[{server.host}]" if ":" in server.host else server.host
        daemon.add_endpoints([f"fawkes://{host}:{server.port}"])

    def loop(self) -> None:
        if self._plugins.poll():
            self._daemon.update_state()
        self._plugins.notify_watchers()

    def deactivate(self) -> None:
        self._plugins.close()
        self._server.stop()
