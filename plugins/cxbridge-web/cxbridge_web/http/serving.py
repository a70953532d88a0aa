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
from cxbridge_web.http.connections import IdleLimitedConnection

if TYPE_CHECKING:
    from starlette.types import ASGIApp

    from cxbridge.events import Logger
    from cxbridge_web.settings import WebSettings

MAX_CONNECTIONS: Final = 200  # number of simultaneous connections

_START_TIMEOUT_S: Final = 10.0
_STOP_TIMEOUT_S: Final = 5.0  # the time for open responses to finish
_MAX_BACKLOG: Final = 64  # connections that wait to be accepted


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
    :raises CxbridgeError: if the address is unavailable or the settings are invalid.
    """

    def __init__(self, settings: WebSettings, log: Logger) -> None:
        settings.check()
        self._settings = settings
        self._log = log
        self._listening_socket = listen(settings.host, settings.port)
        self.port: int = self._listening_socket.getsockname()[1]
        self._server: _Uvicorn | None = None
        self._thread: LoopThread | None = None
        self._serving_result: Future[None] = Future()
        self._handler = _LogHandler(log)

    @property
    def url(self) -> str:
        host = f"[{self._settings.host}]" if ":" in self._settings.host else self._settings.host
        return f"http{'s' if self._settings.tls_cert else ''}://{host}:{self.port}"

    def start(self, app: ASGIApp) -> None:
        """Serve an application.

        :raises CxbridgeError: if the certificate is unusable or the server does not start in time.
        """
        try:
            self._server = _Uvicorn(self._make_configuration(app))
        except Exception:
            self._listening_socket.close()
            raise
        logging.getLogger("uvicorn.error").addHandler(self._handler)
        serving = self._server.serving
        self._thread = LoopThread("web")
        self._serving_result = self._thread.spawn(self._server.serve(sockets=[self._listening_socket]))
        # a failed start must end the wait, too
        self._serving_result.add_done_callback(lambda _: serving.set())
        if not serving.wait(_START_TIMEOUT_S) or self._serving_result.done():
            self.stop()
            self._listening_socket.close()
            raise CxbridgeError(f"the web server at {self.url} did not start", hint="see the log")

    def _make_configuration(self, app: ASGIApp) -> uvicorn.Config:
        settings = self._settings
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
            timeout_graceful_shutdown=1,  # in seconds
            ssl_certfile=settings.tls_cert,
            ssl_keyfile=settings.tls_key,
        )
        config.load()
        return config

    def close(self) -> None:
        """Release the port of a server that was never started."""
        if self._thread is None:
            self._listening_socket.close()

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
        logging.getLogger("uvicorn.error").removeHandler(self._handler)


def listen(host: str, port: int) -> socket.socket:
    """Return a listening socket for an asyncio server.

    :raises CxbridgeError: if the address is unavailable.
    """
    try:
        family, _, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        # with protocol 0, asyncio leaves Nagle's algorithm on, which delays answers by 40 ms
        listening_socket = socket.socket(family, socket.SOCK_STREAM, protocol)
    except OSError as error:
        raise CxbridgeError(f"the web server cannot listen on {host}: {error.strerror}") from error
    try:
        listening_socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening_socket.bind(address)
        listening_socket.listen(_MAX_BACKLOG)
    except OSError as error:
        listening_socket.close()
        hint = "choose another port with cxbridge/web/port; 0: any free port"
        raise CxbridgeError(
            f"the web server cannot listen on {host}:{port}: {error.strerror}", hint=hint
        ) from error
    return listening_socket
