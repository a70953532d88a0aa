"""The web server: a thread that serves, and what the main loop does for it."""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Final

import uvicorn

from cxbridge.blackboard.kit.accepting import Shortage, heed_shortage
from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.errors import CxbridgeError
from cxbridge.navgraph.keeping import NavGraphs
from cxbridge.web.api import Api
from cxbridge.web.catalogue import directory
from cxbridge.web.connections import MOST_SOCKETS, Connection, Door
from cxbridge.web.event_collector import EventCollector
from cxbridge.web.event_streams import EventStreams
from cxbridge.web.extensions import Figures
from cxbridge.web.guard import Guard
from cxbridge.web.pages import Pages
from cxbridge.web.queue import RequestQueue

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

    from cxbridge.events import Logger
    from cxbridge.web.host import WebHost
    from cxbridge.web.settings import WebSettings

MOST_CONNECTIONS: Final = 200
EVENTS_PATH: Final = "/api/cxbridge/events"
COMPONENT: Final = "Web"
"""Under which the server logs."""

_START_S: Final = 10.0
_STOP_S: Final = 5.0
_BACKLOG: Final = 64


class _Uvicorn(uvicorn.Server):
    """Tells when it serves."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.serving = threading.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self.serving.set()


class _LogHandler(logging.Handler):
    """Takes what uvicorn complains of to our log, what clients bring about not each time."""

    def __init__(self, log: Logger) -> None:
        super().__init__(logging.WARNING)
        self._log = log
        self._complaints = Complaints(log.warn)

    def emit(self, record: logging.LogRecord) -> None:
        text = record.getMessage().strip()
        error = record.exc_info[1] if record.exc_info else None
        if error is None:
            self._complaints.add(text, text)
        else:
            self._log.error(f"{text}: {type(error).__name__}: {error}")


class WebServer:
    """Serves in a thread of its own, from :meth:`start` to :meth:`stop`; keeps events from when it is made.

    :param host: the process around it.
    :param most_sockets: connections at a time, at most :data:`~cxbridge.web.connections.MOST_SOCKETS`.
    """

    def __init__(self, host: WebHost, settings: WebSettings, most_sockets: int = MOST_SOCKETS) -> None:
        self._host = host
        self._settings = settings
        self._most_sockets = most_sockets
        self._queue = RequestQueue()
        self._log = host.bus.logger(COMPONENT)
        self._collector = EventCollector(host)
        self._navgraphs = NavGraphs(host.bus)
        self._streams: EventStreams | None = None
        self._api: Api | None = None
        self._server: _Uvicorn | None = None
        self._thread: threading.Thread | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._handler = _LogHandler(self._log)
        self.port = settings.port
        """Where it serves, once it does."""

    @property
    def url(self) -> str:
        """Where it is."""
        host = f"[{self._settings.host}]" if ":" in self._settings.host else self._settings.host
        return f"http{'s' if self._settings.tls_cert else ''}://{host}:{self.port}"

    def start(self) -> None:
        """Begin to serve.

        :raises CxbridgeError: when that is not possible.
        """
        settings = self._settings
        settings.check()
        listening = _listen(settings.host, settings.port)
        if self._most_sockets < MOST_SOCKETS:
            listening.most = self._most_sockets
        try:
            self.port = listening.getsockname()[1]
            self._streams = EventStreams(self._host, self._collector)
            figures = Figures(self._streams, self._collector, self._navgraphs)
            self._api = api = Api(self._host, self._queue, directory(figures), exact=settings.exact)
            self._server = _Uvicorn(self._configured(Guard(_Site(api, self._streams, Pages()), settings)))
        except Exception:
            listening.close()
            raise
        logging.getLogger("uvicorn.error").addHandler(self._handler)
        self._thread = threading.Thread(target=self._serve, args=(listening,), name="web", daemon=True)
        self._thread.start()
        if not self._server.serving.wait(_START_S):
            raise CxbridgeError("the web server does not start")

    def _configured(self, app: Guard) -> uvicorn.Config:
        settings = self._settings
        try:
            config = uvicorn.Config(
                app,
                lifespan="off",
                ws="none",
                http=Connection,
                loop="asyncio",
                log_config=None,
                access_log=False,
                server_header=False,
                proxy_headers=False,
                limit_concurrency=MOST_CONNECTIONS,
                timeout_graceful_shutdown=1,
                ssl_certfile=settings.tls_cert,
                ssl_keyfile=settings.tls_key,
            )
            config.load()
        except OSError as error:  # ssl's errors are some
            raise CxbridgeError(
                f"the certificate and its key cannot be used: {error}", file=settings.tls_cert
            ) from error
        return config

    def _serve(self, listening: socket.socket) -> None:
        server = self._server
        assert server is not None  # made before the thread

        async def serve() -> None:
            self._loop = asyncio.get_running_loop()
            heed_shortage(self._loop, Shortage(self._log.warn))
            await server.serve(sockets=[listening])

        asyncio.run(serve())

    def attend(self) -> None:
        """Do what the server asks for. Called once a loop, by the main loop's thread."""
        self._collector.poll()
        self._queue.poll()

    def stop(self) -> None:
        """Serve no more. A second call does nothing."""
        self._queue.close()
        thread, self._thread = self._thread, None
        if thread is not None and self._server is not None:
            self._server.should_exit = True
            if self._loop is not None and self._streams is not None and not self._loop.is_closed():
                with suppress(RuntimeError):  # it has just come to its end
                    self._loop.call_soon_threadsafe(self._streams.close)
            thread.join(_STOP_S)
        if self._api is not None:
            self._api.close()
        self._collector.close()
        self._navgraphs.close()
        logging.getLogger("uvicorn.error").removeHandler(self._handler)


class _Site:
    """All that is served, by path. An ASGI application."""

    def __init__(self, api: Api, events: EventStreams, pages: Pages) -> None:
        self._api = api
        self._events = events
        self._pages = pages

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        path = scope["path"]
        if path == EVENTS_PATH and scope["method"] == "GET":
            await self._events(scope, receive, send)
        elif path == "/api" or path.startswith("/api/"):
            await self._api(scope, receive, send)
        else:
            await self._pages(scope, receive, send)


def _listen(host: str, port: int) -> Door:
    """Return a socket that listens.

    :raises CxbridgeError: when that is not possible.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listening = Door(family, socket.SOCK_STREAM)
    except OSError as error:
        raise CxbridgeError(f"the web server cannot be at {host}: {error.strerror}") from error
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
        listening.listen(_BACKLOG)
    except OSError as error:
        listening.close()
        hint = "choose another with cxbridge/web/port; 0: any free one"
        raise CxbridgeError(
            f"the web server cannot be at {host}:{port}: {error.strerror}", hint=hint
        ) from error
    return listening
