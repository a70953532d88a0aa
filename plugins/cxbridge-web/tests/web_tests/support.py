"""A daemon with a web server in this process, and a client for it."""

from __future__ import annotations

import json
import ssl
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from tests.daemon.test_daemon import QUIET, WAIT_S, running

WEB: tuple[tuple[str, Any], ...] = (*QUIET, ("web/enable", True), ("web/port", 0))


@dataclass
class Answer:
    """The answer to a request, whatever its status."""

    status: int
    headers: Any
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)

    @property
    def text(self) -> str:
        return self.body.decode()


@dataclass
class Client:
    """A client of the web server.

    :ivar headers: headers of each request.
    :ivar tls: the context of ``https``; None for ``http``.
    """

    url: str
    headers: dict[str, str] = field(default_factory=dict)
    tls: ssl.SSLContext | None = None

    def open(self, method: str, path: str, body: Any = None, **headers: str) -> Any:
        """Return the open reply.

        :param body: bytes, or an object that is sent as JSON.
        :param headers: with ``_`` instead of ``-``.
        :raises urllib.error.HTTPError: when the status is an error.
        """
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        request_headers = {name.replace("_", "-"): value for name, value in headers.items()}
        if data is not None:
            request_headers.setdefault("Content-Type", "application/json")
        request = urllib.request.Request(
            self.url + path, data, {**self.headers, **request_headers}, method=method
        )
        return urllib.request.urlopen(request, timeout=WAIT_S, context=self.tls)

    def ask(self, method: str, path: str, body: Any = None, **headers: str) -> Answer:
        """Return the complete answer, whatever its status; the parameters are those of ``open``."""
        try:
            with self.open(method, path, body, **headers) as reply:
                return Answer(reply.status, reply.headers, reply.read())
        except urllib.error.HTTPError as error:
            with error:
                return Answer(error.code, error.headers, error.read())

    def get(self, path: str, **headers: str) -> Answer:
        return self.ask("GET", path, **headers)

    def until(self, path: str, is_wanted: Any) -> Any:
        """Repeat the request until ``is_wanted`` accepts the answer."""
        pause = threading.Event()
        for _ in range(WAIT_S * 20):
            answer = self.get(path).json
            if is_wanted(answer):
                return answer
            pause.wait(0.05)
        raise AssertionError(f"{path} is still {answer}")


@contextmanager
def serving(
    settings: tuple[tuple[str, Any], ...] = (), **options: Any
) -> Iterator[tuple[Any, Client, list[str]]]:
    """Yield a daemon with a web server, a client and the daemon's log.

    :param options: further arguments of :func:`tests.daemon.test_daemon.running`.
    """
    with running(settings=(*WEB, *settings), **options) as (daemon, lines, _):
        yield daemon, Client(daemon.endpoints[-1]), lines


def read_events(stream: Any) -> Iterator[tuple[str, str, Any]]:
    """Yield id, event and data of each event of a stream."""
    fields = {"id": "", "event": "", "data": ""}
    while line := stream.readline().decode():
        name, _, value = line.rstrip("\n").partition(": ")
        if name in fields:
            fields[name] = value
        elif not name and fields["data"]:
            yield fields["id"], fields["event"], json.loads(fields["data"])
            fields = {"id": "", "event": "", "data": ""}
