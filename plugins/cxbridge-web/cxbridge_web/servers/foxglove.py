"""The server of a daemon for Foxglove, which receives events from its configuration on."""

from __future__ import annotations

from cxbridge.daemon.daemon import Daemon
from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge_web.foxglove.serving import make_foxglove_server
from cxbridge_web.foxglove.settings import FoxgloveSettings


class FoxgloveComponent(Component):
    """Sends events, poses and transforms to Foxglove."""

    hooks = (Hook.POST_LOOP,)
    steady = True

    def __init__(self, daemon: Daemon) -> None:
        settings, self._daemon = daemon.section("foxglove"), daemon
        assert isinstance(settings, FoxgloveSettings)
        self._server = make_foxglove_server(daemon.bus, settings)

    def activate(self) -> None:
        self._server.start()
        self._daemon.add_endpoints([self._server.url], "Foxglove")

    def loop(self) -> None:
        """Send kept messages to further subscribers."""
        self._server.attend()

    def close(self) -> None:
        self._server.stop()
