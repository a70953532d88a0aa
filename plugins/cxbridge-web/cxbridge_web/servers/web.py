"""The web server of a daemon, which collects events from its configuration on, before it serves."""

from __future__ import annotations

from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.process import raise_file_limit
from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge_web.daemon_source import DaemonWeb
from cxbridge_web.options import WebOptions
from cxbridge_web.server import WebServer
from cxbridge_web.settings import WebSettings


class WebComponent(Component):
    """Serves the web page and the REST API; the main loop answers its requests."""

    hooks = (Hook.PRE_LOOP,)
    steady = True

    def __init__(self, daemon: Daemon) -> None:
        settings, self._daemon = daemon.section("web"), daemon
        assert isinstance(settings, WebSettings)
        self._options = daemon.options.group(WebOptions)
        raise_file_limit()
        host = DaemonWeb(self._daemon)
        self._server = WebServer(host, settings)

    def activate(self) -> None:
        self._server.start()
        self._daemon.add_endpoints([self._server.url], "the web page and the REST API")
        if self._options is not None:
            self._options.announce(self._server.url)

    def loop(self) -> None:
        self._server.attend()

    def close(self) -> None:
        self._server.stop()
