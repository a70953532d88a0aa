"""Foxglove, connected to a single run: ``cxbridge run --foxglove``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from cxbridge.mainloop import Hook
from cxbridge_web.foxglove.serving import make_foxglove_server

if TYPE_CHECKING:
    from cxbridge.run.assembly import Assembly
    from cxbridge.run.result import RunResult
    from cxbridge.run.team import Team
    from cxbridge_web.foxglove.live import FoxgloveServer
    from cxbridge_web.foxglove.settings import FoxgloveSettings


class RunFoxglove:
    """Lets Foxglove connect to a run; :class:`~cxbridge.daemon.servers.run_watch.RunServer`.

    :param on_ready: gets the address, once it is served.
    """

    def __init__(self, settings: FoxgloveSettings, on_ready: Callable[[str], None]) -> None:
        self._settings = settings
        self._on_ready = on_ready
        self._server: FoxgloveServer | None = None

    @contextmanager
    def serve(self, run: Assembly | Team) -> Iterator[None]:
        """Serve a run.

        :raises CxbridgeError: when the package or the port cannot be had.
        """
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
        """Serve those who have just subscribed."""
        if self._server is not None:
            self._server.attend()

    def finish(self, result: RunResult) -> None:
        """Do nothing: what still holds is kept for those who come."""
