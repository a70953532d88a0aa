"""The server for Foxglove as a component of a daemon, and as a server of a single run.

The server needs the package foxglove-sdk, an optional dependency.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from cxbridge.errors import CxbridgeError
from cxbridge.extras import install_command
from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge.run.servers import RunServer
from cxbridge_web.foxglove.settings import FoxgloveSettings

if TYPE_CHECKING:
    from cxbridge.daemon.daemon import Daemon
    from cxbridge.events import EventBus
    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team
    from cxbridge_web.foxglove.server import FoxgloveServer


def make_foxglove_server(bus: EventBus, settings: FoxgloveSettings) -> FoxgloveServer:
    """Return a server that is not started yet.

    :raises CxbridgeError: if the server would be public without `insecure`, or foxglove-sdk is missing.
    """
    settings.check()
    try:
        from cxbridge_web.foxglove.server import FoxgloveServer  # noqa: PLC0415 - foxglove-sdk may be missing
    except ModuleNotFoundError as error:
        raise CxbridgeError(
            f"live connections to Foxglove need the package '{error.name}'",
            hint=install_command("foxglove", "cxbridge-web"),
        ) from None
    return FoxgloveServer(bus, settings)


class FoxgloveComponent(Component):
    """Sends the events, poses and transforms of a daemon to Foxglove."""

    hooks = (Hook.POST_LOOP,)
    steady = True  # like the web server, the component stays when a client stops components

    def __init__(self, daemon: Daemon) -> None:
        settings, self._daemon = daemon.section("foxglove"), daemon
        assert isinstance(settings, FoxgloveSettings)
        self._server = make_foxglove_server(daemon.bus, settings)

    def activate(self) -> None:
        self._server.start()
        self._daemon.add_endpoints([self._server.url], "Foxglove")

    def loop(self) -> None:
        """Send the last values to new subscribers."""
        self._server.serve_new_subscribers()

    def close(self) -> None:
        self._server.stop()


class RunFoxglove(RunServer):
    """Serves a run to Foxglove; clients that connect after the end of the run get the last values.

    :param on_ready: called with the address of the server.
    """

    lingering_name = "Foxglove"

    def __init__(self, settings: FoxgloveSettings, on_ready: Callable[[str], None]) -> None:
        self._settings = settings
        self._on_ready = on_ready
        self._server: FoxgloveServer | None = None

    @contextmanager
    def serve(self, run: Run | Team) -> Iterator[None]:
        server = self._server = make_foxglove_server(run.bus, self._settings)
        try:
            server.start()
            self._on_ready(server.url)
            run.loop.add(Hook.POST_LOOP, server.serve_new_subscribers)
            yield
        finally:
            server.stop()

    def attend(self) -> None:
        """Send the last values to new subscribers."""
        if self._server is not None:
            self._server.serve_new_subscribers()
