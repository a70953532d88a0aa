"""The REST API as an ASGI application: routing of requests and encoding of responses.

A handler runs in the main loop, which owns the executive and the blackboard; a handler that waits runs in a
thread. The server's event loop itself only routes, and never blocks.
"""

from __future__ import annotations

import asyncio
import json
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from cxbridge.errors import CxbridgeError
from cxbridge.rights import RefusedError
from cxbridge_web import openapi
from cxbridge_web.endpoint import ApiCall, ApiError, Endpoint, Handler, TextReply
from cxbridge_web.endpoint_table import make_endpoint_table
from cxbridge_web.extensions.state import ServerState
from cxbridge_web.host import WebHost
from cxbridge_web.models import to_json
from cxbridge_web.request_queue import RequestQueue

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

MAX_BODY_BYTES: Final = 1 << 20  # the largest size of a request body

BODY_TIMEOUT_S: Final = 10.0  # time limit for receiving a body

MAX_WAITING_REQUESTS: Final = 16  # number of requests that may run in a thread or wait for one

_THREAD_COUNT: Final = 4  # number of threads that wait for answers; further requests wait for a thread
_NO_CACHE: Final = {"Cache-Control": "no-cache, no-store, must-revalidate, max-age=0"}


class Api:
    """Serves the requests below ``/api``; an ASGI application."""

    def __init__(self, host: WebHost, state: ServerState, queue: RequestQueue) -> None:
        self._host = host
        self._state = state
        self._queue = queue
        self._endpoint_table = make_endpoint_table()
        self._log = host.bus.logger("Web")
        self._threads = ThreadPoolExecutor(_THREAD_COUNT, "web-wait")
        self._waiting_count = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        request = Request(scope, receive)
        is_pretty = "pretty" in request.query_params
        try:
            response = await self._handle_request(request, is_pretty=is_pretty)
        except ClientDisconnect:
            return
        except ApiError as error:
            response = _make_response(error.model or TextReply(error.text), error.status, is_pretty=is_pretty)
        await response(scope, receive, send)

    async def _handle_request(self, request: Request, *, is_pretty: bool) -> Response:
        path: str = request.scope["path"]
        if request.method == "GET" and path == f"/api{openapi.DOCUMENT_PATH}":
            return _make_response(
                openapi.make_document(self._endpoint_table.endpoints), 200, is_pretty=is_pretty
            )
        endpoint, path_values = self._endpoint_table.find(request.method, path.removeprefix("/api"))
        self._check_right(endpoint)
        body = await read_json_object(request) if endpoint.body else {}
        call = ApiCall(self._host, self._state, path_values, dict(request.query_params), body)
        try:
            handler = self._find_thread_handler(endpoint)
            if handler is not None:
                content = await self._run_in_thread(handler, call)
            else:
                content = await self._run_in_loop(endpoint, call)
            # a long text is encoded in a thread, where it does not delay other clients
            return await asyncio.to_thread(
                lambda: _make_response(endpoint.finish(call, content), 200, is_pretty=is_pretty)
            )
        except CxbridgeError as error:
            hint = f" ({error.hint})" if error.hint else ""
            raise ApiError(
                403 if isinstance(error, RefusedError) else 400, f"{error.message}{hint}"
            ) from error
        except ApiError:
            raise
        except Exception as error:
            self._log.error(f"{request.method} {path} failed: {type(error).__name__}: {error}")
            raise ApiError(500, f"Execution failed: {type(error).__name__}: {error}") from error

    def _check_right(self, endpoint: Endpoint) -> None:
        """Check the client's right before reading the body.

        :raises ApiError: if clients lack the right of the endpoint.
        """
        rights = self._host.rights
        needed_right = endpoint.needed_right(rights)
        if not rights.allows(needed_right):
            forbidden_action = "change anything" if not rights.control else "run programs"
            raise ApiError(403, f"Clients may not {forbidden_action}: {rights.refusal_hint(needed_right)}")

    def _find_thread_handler(self, endpoint: Endpoint) -> Handler | None:
        """Return the handler that runs in a thread; None for a handler that runs in the main loop."""
        if endpoint.runs_in_thread:
            return endpoint.handler
        return endpoint.stalled_handler if self._host.stall_reason else None

    async def _run_in_thread(self, handler: Handler, call: ApiCall) -> Any:
        """Run, in a thread, a handler that may wait.

        :raises ApiError: if too many requests are waiting, or the handler raises it.
        """
        if self._waiting_count >= MAX_WAITING_REQUESTS:
            raise ApiError(503, "Too many requests are waiting already")
        self._waiting_count += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._threads, handler, call)
        finally:
            self._waiting_count -= 1

    def close(self) -> None:
        """Cancel the requests that wait for a thread."""
        self._threads.shutdown(wait=False, cancel_futures=True)

    async def _run_in_loop(self, endpoint: Endpoint, call: ApiCall) -> Any:
        """Let the main loop call the handler, and return its result.

        :raises ApiError: if the main loop does not answer in time or takes no further requests, or the
            handler raises it.
        """
        key = None
        if endpoint.method == "GET":  # only requests without effects may share a call
            key = (endpoint.path, tuple(call.path_values.items()), tuple(sorted(call.query.items())))
        try:
            result = asyncio.wrap_future(self._queue.submit(partial(endpoint.handler, call), key))
            result.add_done_callback(_retrieve_error)
            # several clients may wait for the same result: one disconnect must not cancel it
            return await asyncio.wait_for(asyncio.shield(result), endpoint.timeout_s)
        except TimeoutError as error:
            stall_reason = self._host.stall_reason
            reason = f": {stall_reason}" if stall_reason else ""
            message = f"The main loop did not answer within {endpoint.timeout_s:g} s{reason}"
            raise ApiError(503, message) from error


def _retrieve_error(result: asyncio.Future[Any]) -> None:
    """Retrieve the error of an abandoned request, since asyncio would print it."""
    if not result.cancelled():
        result.exception()


async def read_json_object(request: Request) -> dict[str, Any]:
    """Return the body, a JSON object.

    :raises ApiError: if the body is too long, arrives too slowly, is not a JSON object, or has another
        Content-Type than JSON.
    """
    media_type = request.headers.get("content-type", "application/json").partition(";")[0].strip().lower()
    if media_type != "application/json":
        raise ApiError(400, "The body must be JSON: Content-Type application/json")
    body = bytearray()
    try:
        async with asyncio.timeout(BODY_TIMEOUT_S):
            async for chunk in request.stream():
                body += chunk
                if len(body) > MAX_BODY_BYTES:
                    raise ApiError(413, f"The body is longer than {MAX_BODY_BYTES} bytes")
    except TimeoutError as error:
        raise ApiError(408, f"The body did not arrive within {BODY_TIMEOUT_S:g} s") from error
    try:
        json_value = json.loads(body)
        if b"\\ud" in body.lower():
            json.dumps(json_value, ensure_ascii=False).encode()  # raises ValueError for a lone surrogate
    except (ValueError, RecursionError) as error:
        raise ApiError(400, f"The body is not JSON: {error}") from error
    if not isinstance(json_value, dict):
        raise ApiError(400, "The body is not a JSON object")
    return json_value


def _make_response(content: Any, status: int, *, is_pretty: bool) -> Response:
    if isinstance(content, TextReply):
        return Response(
            content.encode("utf-8", "replace"),
            status,
            headers=_NO_CACHE,
            media_type="text/plain; charset=utf-8",
        )
    return Response(
        to_json(content, is_pretty=is_pretty), status, headers=_NO_CACHE, media_type="application/json"
    )
