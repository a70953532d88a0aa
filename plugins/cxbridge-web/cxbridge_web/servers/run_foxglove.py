"""Foxglove for a single run: ``cxbridge run --foxglove``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from cxbridge.mainloop import Hook
from cxbridge.run.servers import RunServer
from cxbridge_web.foxglove.serving import make_foxglove_server

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team
    from cxbridge_web.foxglove.live import FoxgloveServer
    from cxbridge_web.foxglove.settings import FoxgloveSettings


class RunFoxglove(RunServer):
    """Serves a run to Foxglove; clients that connect after its end get the last values.

    :param on_ready: called with the address of the server.
    """

    stays = "Foxglove"

    def __init__(self, settings: FoxgloveSettings, on_ready: Callable[[str], None]) -> None:
        self._settings = settings
        self._on_ready = on_ready
        self._server: FoxgloveServer | None = None

    @contextmanager
    def serve(self, run: Run | Team) -> Iterator[None]:
        server = make_foxglove_server(run.bus, self._settings)
        try:
            server.start()
            self._server = server
            self._on_ready(server.url)
            run.loop.add(Hook.POST_LOOP, server.attend)
            yield
        finally:
            server.stop()

    def attend(self) -> None:
        """Send the last values to further subscribers."""
        if self._server is not None:
            self._server.attend()
