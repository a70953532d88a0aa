"""The web server: a thread that serves HTTP, and its work in the main loop.

A server collects events before it serves, so that clients also get the events since the start of the process.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cxbridge_web.api import Api
from cxbridge_web.directory import make_directory
from cxbridge_web.event_collector import EventCollector
from cxbridge_web.event_streams import EventStreams
from cxbridge_web.extensions.state import ServerState
from cxbridge_web.guard import Guard
from cxbridge_web.http.serving import HttpThread
from cxbridge_web.navgraphs import NavGraphs
from cxbridge_web.pages import Page
from cxbridge_web.queue import RequestQueue

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

    from cxbridge_web.host import WebHost
    from cxbridge_web.settings import WebSettings

EVENTS_PATH: Final = "/api/cxbridge/events"
COMPONENT: Final = "Web"  # component of the log lines


class WebServer:
    """Serves in a thread from :meth:`start` to :meth:`stop`, but collects events from its creation on.

    :param host: the process around the server.
    """

    def __init__(self, host: WebHost, settings: WebSettings) -> None:
        self._host = host
        self._settings = settings
        self._queue = RequestQueue()
        self._log = host.bus.logger(COMPONENT)
        self._collector = EventCollector(host)
        self._navgraphs = NavGraphs(host.bus)
        self._streams: EventStreams | None = None
        self._api: Api | None = None
        self._thread: HttpThread | None = None
        self.port = settings.port  # port of the running server

    @property
    def url(self) -> str:
        """The address of the running server; empty before the start."""
        return "" if self._thread is None else self._thread.url

    def start(self) -> None:
        """Start the thread that serves.

        :raises CxbridgeError: if the address is unavailable or the settings are invalid.
        """
        thread = HttpThread(self._settings, self._log)
        self.port = thread.port
        try:
            self._streams = EventStreams(self._host, self._collector)
            state = ServerState(self._streams, self._collector, self._navgraphs)
            self._api = api = Api(self._host, self._queue, make_directory(state))
            site = _Site(api, self._streams, Page())
        except Exception:
            thread.close()
            raise
        self._thread = thread
        thread.start(Guard(site, self._settings))

    def serve_main_loop(self) -> None:
        """Carry out the requests of the server's thread. Called once a loop, in the main loop's thread."""
        self._collector.poll()
        self._queue.poll()

    def stop(self) -> None:
        """Stop serving; repeated calls are harmless."""
        self._queue.close()  # first: the thread waits for results that the main loop no longer computes
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.stop(self._close_streams)
        if self._api is not None:
            self._api.close()
        self._collector.close()
        self._navgraphs.close()

    def _close_streams(self) -> None:
        if self._streams is not None:
            self._streams.close()


class _Site:
    """Routes requests to API, events and page; an ASGI application."""

    def __init__(self, api: Api, events: EventStreams, page: Page) -> None:
        self._api = api
        self._events = events
        self._page = page

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        path = scope["path"]
        if path == EVENTS_PATH and scope["method"] == "GET":
            await self._events(scope, receive, send)
        elif path == "/api" or path.startswith("/api/"):
            await self._api(scope, receive, send)
        else:
            await self._page(scope, receive, send)
