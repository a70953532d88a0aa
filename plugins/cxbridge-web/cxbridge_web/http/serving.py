"""An HTTP server in a thread."""

from __future__ import annotations

import logging
import socket
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from typing import TYPE_CHECKING, Final

import uvicorn

from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.blackboard.kit.event_loop import LoopThread
from cxbridge.errors import CxbridgeError
from cxbridge.listening import listen, url_host
from cxbridge_web.http.connections import IdleLimitedConnection

if TYPE_CHECKING:
    from starlette.types import ASGIApp

    from cxbridge.events import Logger
    from cxbridge_web.settings import WebSettings

MAX_CONNECTIONS: Final = 200  # number of simultaneous connections

_START_TIMEOUT_S: Final = 10.0  # far longer than a start takes
_STOP_TIMEOUT_S: Final = 5.0  # includes the second that uvicorn gives open responses


class _Uvicorn(uvicorn.Server):
    """A server that sets the event ``serving`` once it has started."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.serving = threading.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self.serving.set()


class _LogHandler(logging.Handler):
    """Forwards uvicorn's warnings to the log, and limits the warnings that clients cause."""

    def __init__(self, log: Logger) -> None:
        super().__init__(logging.WARNING)
        self._log = log
        self._complaints = Complaints(log.warn)

    def emit(self, record: logging.LogRecord) -> None:
        text = record.getMessage().strip()
        error = record.exc_info[1] if record.exc_info else None
        if error is None:
            self._complaints.add(text, text)
        else:  # a fault of the server, which clients cannot cause at will
            self._log.error(f"{text}: {type(error).__name__}: {error}")


class HttpThread:
    """Serves an application in a thread.

    :param log: receives the warnings and errors of the server.
    """

    def __init__(self, settings: WebSettings, log: Logger) -> None:
        self._settings = settings
        self._log_handler = _LogHandler(log)
        self._server: _Uvicorn | None = None
        self._thread: LoopThread | None = None
        self._serving_result: Future[None] = Future()
        self.url = ""
        """The address of the server; empty before the start."""

    def start(self, app: ASGIApp) -> None:
        """Serve an application.

        :raises CxbridgeError: if the settings are invalid, the address is unavailable or the server does not
            start in time.
        """
        settings = self._settings
        settings.check()
        listening_socket = listen(
            "the web server",
            settings.host,
            settings.port,
            hint="choose another port with cxbridge/web/port; 0: any free port",
        )
        scheme = "https" if settings.tls_cert else "http"
        self.url = f"{scheme}://{url_host(settings.host)}:{listening_socket.getsockname()[1]}"
        try:
            self._server = server = _Uvicorn(_make_configuration(app, settings))
        except Exception:
            listening_socket.close()
            raise
        logging.getLogger("uvicorn.error").addHandler(self._log_handler)
        self._thread = LoopThread("web")
        self._serving_result = self._thread.spawn(server.serve(sockets=[listening_socket]))
        # a failed start must end the wait, too
        self._serving_result.add_done_callback(lambda _: server.serving.set())
        if not server.serving.wait(_START_TIMEOUT_S) or self._serving_result.done():
            self.stop()
            listening_socket.close()
            raise CxbridgeError(f"the web server at {self.url} did not start", hint="see the log")

    def stop(self, close_streams: Callable[[], None] = lambda: None) -> None:
        """Stop serving; repeated calls are harmless.

        :param close_streams: ends the open streams of events; called in the server's thread.
        """
        thread, self._thread = self._thread, None
        if thread is not None and self._server is not None:
            self._server.should_exit = True
            thread.call(close_streams)
            with suppress(TimeoutError, CancelledError):
                self._serving_result.result(_STOP_TIMEOUT_S)
            thread.close()
        logging.getLogger("uvicorn.error").removeHandler(self._log_handler)


def _make_configuration(app: ASGIApp, settings: WebSettings) -> uvicorn.Config:
    config = uvicorn.Config(
        app,
        # the application has no start-up code and no WebSockets
        lifespan="off",
        ws="none",
        http=IdleLimitedConnection,
        loop="asyncio",
        log_config=None,  # `_LogHandler` forwards the warnings
        access_log=False,
        server_header=False,
        proxy_headers=False,  # any client could pretend to be a proxy
        limit_concurrency=MAX_CONNECTIONS,
        timeout_graceful_shutdown=1,  # seconds for open responses to finish
        ssl_certfile=settings.tls_cert,
        ssl_keyfile=settings.tls_key,
    )
    config.load()  # reads the certificate here, so that its errors end the start
    return config
