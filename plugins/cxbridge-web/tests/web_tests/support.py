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
    url: str
    headers: dict[str, str] = field(default_factory=dict)
    tls: ssl.SSLContext | None = None

    def open(self, method: str, path: str, body: Any = None, **headers: str) -> Any:
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        request_headers = {name.replace("_", "-"): value for name, value in headers.items()}
        if data is not None:
            request_headers.setdefault("Content-Type", "application/json")
        request = urllib.request.Request(
            self.url + path, data, {**self.headers, **request_headers}, method=method
        )
        return urllib.request.urlopen(request, timeout=WAIT_S, context=self.tls)

    def ask(self, method: str, path: str, body: Any = None, **headers: str) -> Answer:
        try:
            with self.open(method, path, body, **headers) as reply:
                return Answer(reply.status, reply.headers, reply.read())
        except urllib.error.HTTPError as error:
            with error:
                return Answer(error.code, error.headers, error.read())

    def get(self, path: str, **headers: str) -> Answer:
        return self.ask("GET", path, **headers)

    def until(self, path: str, wanted: Any) -> Any:
        """Repeat the request until ``wanted`` accepts the answer."""
        pause = threading.Event()
        for _ in range(WAIT_S * 20):
            answer = self.get(path).json
            if wanted(answer):
                return answer
            pause.wait(0.05)
        raise AssertionError(f"{path} is still {answer}")


@contextmanager
def serving(
    settings: tuple[tuple[str, Any], ...] = (), **named: Any
) -> Iterator[tuple[Any, Client, list[str]]]:
    """Yield a daemon with a web server, a client and the daemon's log."""
    with running(settings=(*WEB, *settings), **named) as (daemon, lines, _):
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
