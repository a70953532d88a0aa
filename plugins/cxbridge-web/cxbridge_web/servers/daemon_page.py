"""The web page of a daemon: the component that serves it, and the daemon as its data source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cxbridge.daemon.daemon import Daemon
from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge_web.host import WebHost
from cxbridge_web.options import WebOptions
from cxbridge_web.settings import WebSettings
from cxbridge_web.web_server import WebServer

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.executive.executive import Executive
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.rights import Rights


class WebComponent(Component):
    """Serves the web page and the REST API; the main loop answers its requests.

    The component collects events from its creation on, so that the page also shows the start of the daemon.
    """

    hooks = (Hook.PRE_LOOP,)
    steady = True  # clients cannot stop the server that serves them

    def __init__(self, daemon: Daemon) -> None:
        settings, self._daemon = daemon.section("web"), daemon
        assert isinstance(settings, WebSettings)
        self._options = daemon.options.find_group(WebOptions)
        self._server = WebServer(DaemonHost(daemon), settings)

    def activate(self) -> None:
        self._server.start()
        self._daemon.add_endpoints([self._server.url], "the web page and the REST API")
        if self._options is not None:
            self._options.announce(self._server.url)

    def loop(self) -> None:
        self._server.serve_main_loop()

    def close(self) -> None:
        self._server.stop()


class DaemonHost(WebHost):
    """A daemon as the data source of its web server."""

    def __init__(self, daemon: Daemon) -> None:
        super().__init__(daemon)
        self._daemon, self._executive_node = daemon, daemon.node
        self.operations = daemon.operations

    def run_command(self, verb: str) -> None:
        self._daemon.carry_out(verb)

    @property
    def board(self) -> BlackBoard:
        return self._daemon.board

    @property
    def rights(self) -> Rights:
        return self._daemon.settings.rights

    @property
    def executive(self) -> Executive | None:
        return None if self._executive_node is None else self._executive_node.executive

    def environments(self) -> Mapping[str, ClipsEnvironment]:
        return {} if self._executive_node is None else self._executive_node.environments

    def status(self) -> dict[str, Any]:
        daemon = self._daemon
        components = daemon.component_statuses()
        return self._make_status(
            daemon.state,
            [component.to_json() for component in components],
            endpoints=daemon.endpoints,
            # the first reason of a component serves as the error of the daemon
            error=next(
                (f"{component.name}: {component.reason}" for component in components if component.reason), ""
            ),
        )

    @property
    def stall_reason(self) -> str:
        return self._daemon.stalls.text

    def interrupt(self) -> None:
        self._daemon.stalls.interrupt()

    def list_components(self) -> Sequence[tuple[str, str, bool]]:
        return self._daemon.lifecycle.list_changeable()

    def set_component_active(self, name: str, *, is_active: bool) -> None:
        lifecycle = self._daemon.lifecycle
        (lifecycle.start_component if is_active else lifecycle.stop_component)(name)
