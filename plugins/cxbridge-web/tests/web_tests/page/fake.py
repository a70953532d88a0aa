"""A server with the real page and a fake daemon, whose answers and events come from tests."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from typing import Any, Self

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Mount, Route

from cxbridge.listening import LOOPBACK, listen
from cxbridge_web.pages import Page

BUNCH = 500
"""The number of events of a message, similar to that of the daemon."""

ROUND_S = 0.02
"""The period of a stream in seconds."""
MAX_IDLE_ROUNDS = 25
"""The periods without events before a comment; each comment costs the browser time."""

START_US = 1_700_000_000_000_000


class FakeDaemon:
    """Answers below ``/api``.

    :ivar answers: replies to GET, by path below ``/api/``, without the query.
    :ivar replies: replies to changing requests, by path; a function is called for its reply.
    :ivar requests: all requests: method, path with query, body.
    :ivar files: further files of the server, by name below ``/files/``.
    """

    def __init__(self) -> None:
        self.answers: dict[str, Any] = {}
        self.replies: dict[str, Any] = {}
        self.files: dict[str, bytes] = {}
        self.requests: list[tuple[str, str, Any]] = []
        self.events: list[dict[str, Any]] = []
        self.state = "RUNNING"
        self.epoch = "a"
        """The prefix of event ids, which differs between daemons."""
        self.refusal: str | None = None
        """The error of each changing request, if set."""
        self.environments = ["executive"]
        self.remote_control = True
        self.stopped: dict[str, Any] | None = None
        self.result: dict[str, Any] | None = None
        """The result of a finished run."""
        self.locked = False
        """Whether all requests below ``/api`` need a token."""
        self._lock = threading.Lock()
        self._closed = threading.Event()

    def send_events(self, *events: dict[str, Any]) -> None:
        """Send events to present and later streams."""
        with self._lock:
            self.events.extend(events)

    def count(self, method: str, path: str) -> int:
        """Return the number of requests for a path, with any query."""
        with self._lock:
            return sum(each[0] == method and each[1].partition("?")[0] == path for each in self.requests)

    def status(self) -> dict[str, Any]:
        """Return the reply of ``/cxbridge/status``."""
        return {
            "kind": "Status",
            "state": self.state,
            "version": "0",
            "pid": 1,
            "started_us": START_US,
            "now_us": START_US + 60_000_000,
            "clock": "scaled",
            "endpoints": [],
            "error": "",
            "remote_control": self.remote_control,
            "remote_programs": True,
            "loop": {"count": 9, "period_us": 33333},
            "components": [{"name": "executive", "state": "ACTIVE", "since_us": START_US, "reason": ""}],
            "environments": [
                {"name": name, "facts": 3, "rules": 2, "agenda": 0} for name in self.environments
            ],
            "web": {"clients": 1},
            **({"stopped": self.stopped} if self.stopped else {}),
            **({"result": self.result} if self.result else {}),
        }

    async def answer(self, request: Request) -> Response:
        """Answer a request for the API."""
        path = request.path_params["path"]
        body = await request.body()
        with self._lock:
            query = f"?{request.url.query}" if request.url.query else ""
            self.requests.append((request.method, path + query, json.loads(body) if body else None))
        if self.locked:
            return PlainTextResponse("A token is needed", 401)
        if request.method == "GET":
            return self._answer_get(path)
        return self._answer_change(path)

    def _answer_get(self, path: str) -> Response:
        if path == "cxbridge/status":
            return JSONResponse(self.status())
        if path in self.answers:
            return JSONResponse(self.answers[path])
        return PlainTextResponse("no such path", 404)

    def _answer_change(self, path: str) -> Response:
        if self.refusal is not None:
            return PlainTextResponse(self.refusal, 400)
        states = {"cxbridge/pause": "PAUSED", "cxbridge/resume": "RUNNING"}
        if path in states:
            self.state = states[path]
            return JSONResponse(self.status())
        reply = self.replies.get(path, {"index": 4711, "msgid": 12})
        return JSONResponse(reply() if callable(reply) else reply)

    async def file(self, request: Request) -> Response:
        """Serve a file."""
        content = self.files.get(request.path_params["name"])
        return PlainTextResponse("Not Found", 404) if content is None else Response(content)

    async def follow(self, request: Request) -> Response:
        """Stream events."""
        if self.locked:
            return PlainTextResponse("A token is needed", 401)
        kinds = request.query_params["kinds"].split(",")
        since = request.headers.get("last-event-id") or request.query_params.get("since", "0")

        async def stream() -> AsyncIterator[bytes]:
            hello = {"kind": "hello", "time_us": 0, "last": f"{self.epoch}-0"}
            yield f"event: hello\ndata: {json.dumps(hello)}\n\n".encode()
            at = int(since)
            idle_rounds = 0
            while not self._closed.is_set():
                with self._lock:
                    new_events = self.events[at:]
                matching: list[dict[str, Any]] = []
                for event in new_events:
                    if event["kind"] == "dropped":
                        yield f"event: dropped\ndata: {json.dumps(event)}\n\n".encode()
                    elif event["kind"] in kinds:
                        matching.append(event)
                at += len(new_events)
                for begin in range(0, len(matching), BUNCH):
                    lines = "".join(
                        f"data: {json.dumps(event)}\n" for event in matching[begin : begin + BUNCH]
                    )
                    yield f"id: {at}\n{lines}\n".encode()
                idle_rounds = 0 if matching else idle_rounds + 1
                if idle_rounds >= MAX_IDLE_ROUNDS:
                    idle_rounds = 0
                    yield b": alive\n\n"
                await asyncio.sleep(ROUND_S)

        return StreamingResponse(stream(), media_type="text/event-stream")

    def close(self) -> None:
        """End the streams."""
        self._closed.set()


class PageServer:
    """A server of a fake daemon, which can stop and restart at the same address.

    :ivar daemon: the present daemon. Each test has its daemon; the address is shared.
    """

    def __init__(self, daemon: FakeDaemon) -> None:
        self.daemon = daemon
        self._listening = listen("the page", LOOPBACK, 0, hint="")
        self._port = self._listening.getsockname()[1]
        self.url = f"http://127.0.0.1:{self._port}/"
        self._server: uvicorn.Server | None = None
        self._thread: threading.Thread | None = None
        routes = [
            Route("/api/cxbridge/events", self._follow),
            Route("/api/{path:path}", self._answer, methods=["GET", "POST", "PUT", "PATCH", "DELETE"]),
            Route("/files/{name}", self._file),
            Mount("/", Page()),
        ]
        self._application = Starlette(routes=routes)
        self.start()

    def start(self) -> None:
        """Start or restart the server."""
        self.daemon._closed.clear()
        config = uvicorn.Config(
            self._application, log_config=None, lifespan="off", ws="none", timeout_graceful_shutdown=1
        )
        if self._listening.fileno() == -1:
            self._listening = listen("the page", LOOPBACK, self._port, hint="")
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, args=([self._listening],), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop, like a killed daemon."""
        assert self._server is not None
        assert self._thread is not None
        self.daemon.close()
        self._server.should_exit = True
        self._thread.join(10)
        self._listening.close()

    @contextmanager
    def serve(self, daemon: FakeDaemon) -> Iterator[Self]:
        """Serve a daemon."""
        self.daemon = daemon
        if self._listening.fileno() == -1:
            self.start()
        try:
            yield self
        finally:
            daemon.close()

    async def _follow(self, request: Request) -> Response:
        return await self.daemon.follow(request)

    async def _answer(self, request: Request) -> Response:
        return await self.daemon.answer(request)

    async def _file(self, request: Request) -> Response:
        return await self.daemon.file(request)


@contextmanager
def serve_daemon(daemon: FakeDaemon) -> Iterator[PageServer]:
    """Serve a fake daemon without fixtures, for a benchmark."""
    server = PageServer(daemon)
    try:
        yield server
    finally:
        server.stop()


def goal_event(goal: str, mode: str, outcome: str = "UNKNOWN", **fields: Any) -> dict[str, Any]:
    """Return the event of a goal's transition."""
    plain = {"goal_class": "CLASS", "sub_type": "nil", "parent": "nil", "error": "", "env": "executive"}
    return (
        {"kind": "goal", "time_us": START_US, "goal": goal, "mode": mode, "outcome": outcome} | plain | fields
    )


def goal_model(
    goal: str, mode: str = "FORMULATED", outcome: str = "UNKNOWN", **fields: Any
) -> dict[str, Any]:
    """Return a goal of the API."""
    plain = {"class": "CLASS", "sub-type": "", "parent": "", "error": [], "plans": [], "parameters": []}
    return {"kind": "Goal", "id": goal, "type": "ACHIEVE", "mode": mode, "outcome": outcome} | plain | fields


def fact_model(index: int, text: str) -> dict[str, Any]:
    """Return a fact of the API."""
    return {
        "kind": "Fact",
        "index": index,
        "template_name": text[1:].split(maxsplit=1)[0],
        "formatted": text,
        "slots": [],
    }
