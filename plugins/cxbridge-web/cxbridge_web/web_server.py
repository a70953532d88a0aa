"""The web server: a thread that serves HTTP, and its work in the main loop.

A server collects events before it serves, so that clients also get the events before the start of serving.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cxbridge_web.api import Api
from cxbridge_web.event_collector import EventCollector
from cxbridge_web.event_streams import EventStreams
from cxbridge_web.extensions.state import ServerState
from cxbridge_web.guard import Guard
from cxbridge_web.http.serving import HttpThread
from cxbridge_web.navgraphs import NavGraphs
from cxbridge_web.openapi import EVENTS_PATH
from cxbridge_web.pages import Page
from cxbridge_web.request_queue import RequestQueue

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

    from cxbridge_web.host import WebHost
    from cxbridge_web.settings import WebSettings

COMPONENT: Final = "Web"  # component of the log lines


class WebServer:
    """Serves in a thread from :meth:`start` to :meth:`stop`, but collects events from its creation on.

    :param host: the process around the server.
    """

    def __init__(self, host: WebHost, settings: WebSettings) -> None:
        self._settings = settings
        self._queue = RequestQueue()
        self._collector = EventCollector(host)
        self._navgraphs = NavGraphs(host.bus)
        self._streams = EventStreams(host, self._collector)
        state = ServerState(self._streams, self._collector, self._navgraphs)
        self._api = Api(host, state, self._queue)
        self._thread = HttpThread(settings, host.bus.logger(COMPONENT))

    @property
    def url(self) -> str:
        """The address of the server; empty before the start."""
        return self._thread.url

    def start(self) -> None:
        """Start the thread that serves.

        :raises CxbridgeError: if the settings are invalid, the address is unavailable or the server does not
            start in time.
        """
        page = Page()

        async def route(scope: Scope, receive: Receive, send: Send) -> None:
            path = scope["path"]
            if path == f"/api{EVENTS_PATH}" and scope["method"] == "GET":
                await self._streams(scope, receive, send)
            elif path == "/api" or path.startswith("/api/"):
                await self._api(scope, receive, send)
            else:
                await page(scope, receive, send)

        self._thread.start(Guard(route, self._settings))

    def serve_main_loop(self) -> None:
        """Carry out the requests of the server's thread. Called once a loop, in the main loop's thread."""
        self._collector.poll()
        self._queue.poll()

    def stop(self) -> None:
        """Stop serving; repeated calls are harmless."""
        self._queue.close()  # first: the thread waits for results that the main loop no longer computes
        self._thread.stop(self._streams.close)
        self._api.close()
        self._collector.close()
        self._navgraphs.close()
