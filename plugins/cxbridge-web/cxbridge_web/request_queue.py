"""The queue of requests that the main loop carries out for the web server.

The main loop must keep its period however much clients request, so it carries out requests between two loops,
for a bounded share of its time. Long requests are generators, which continue in a later loop.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Generator
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, Final

from cxbridge_web.endpoint import ApiError

MAX_WAITING_REQUESTS: Final = 64  # further requests are refused, since each request waits for all before it

# The largest share of the main loop's time for the web server, while pauses are shorter than MAX_PAUSE_S.
MAX_SHARE: Final = 0.1

# The longest pause after requests; without a limit, a reset of two seconds would delay clients by 18 s.
MAX_PAUSE_S: Final = 1.0

# The time after which no further request begins in the same loop: about a seventh of the default period.
MAX_ROUND_S: Final = 0.005


@dataclass(slots=True)
class _QueuedRequest:
    """A request that waits or has begun.

    :param key: requests with the same key share one call; None for a separate call.
    :ivar future: the future result.
    :ivar pieces: the remaining pieces of a request that has begun; None before, and for a plain function.
    """

    function: Callable[[], Any]
    key: object
    future: Future[Any] = field(default_factory=Future)
    pieces: Generator[None, None, Any] | None = None


class RequestQueue:
    """Passes requests of any thread to the thread that calls :meth:`poll`.

    :param now: the clock, in seconds.
    """

    def __init__(self, now: Callable[[], float] = time.perf_counter) -> None:
        self._now = now
        self._lock = threading.Lock()
        self._requests: deque[_QueuedRequest] = deque()
        self._requests_by_key: dict[object, _QueuedRequest] = {}
        self._is_closed = False
        self._pause_end_s = 0.0

    def submit(self, function: Callable[[], Any], key: object = None) -> Future[Any]:
        """Queue a call of a function in the main loop and return its future result.

        A generator runs in pieces: it continues in the same or a later loop after each ``yield``, and its
        return value is the result.

        :param key: waiting requests with the same key share one call; None for a separate call.
        :raises ApiError: if too many requests wait, or the queue is closed.
        """
        with self._lock:
            if self._is_closed:
                raise _make_closed_error()
            shared_request = None if key is None else self._requests_by_key.get(key)
            if shared_request is not None:
                return shared_request.future
            if len(self._requests) >= MAX_WAITING_REQUESTS:
                raise ApiError(503, "Too many requests are waiting for the main loop")
            request = _QueuedRequest(function, key)
            self._requests.append(request)
            if key is not None:
                self._requests_by_key[key] = request
            return request.future

    def poll(self) -> None:
        """Carry out waiting requests until :data:`MAX_ROUND_S` has passed.

        Called once a loop by the main loop's thread. A plain function and a piece of a request are not
        interrupted, so a long one exceeds the limit. A pause follows in any case.
        """
        if not self._requests:
            return
        start_s = self._now()
        if start_s < self._pause_end_s:
            return

        def is_late() -> bool:
            return self._now() - start_s >= MAX_ROUND_S

        while (request := self._take_next()) is not None:
            if not _carry_out(request, is_late):
                self._requeue(request)
            if is_late():
                break
        end_s = self._now()
        # a pause of 9 times the duration of the work keeps the web server within its share of the time
        self._pause_end_s = end_s + min((end_s - start_s) * (1 / MAX_SHARE - 1), MAX_PAUSE_S)

    def _requeue(self, request: _QueuedRequest) -> None:
        """Queue an unfinished request again, after the waiting requests."""
        with self._lock:
            if not self._is_closed:
                self._requests.append(request)
                return
        request.future.set_exception(_make_closed_error())

    def close(self) -> None:
        """Reject waiting and later requests; repeated calls are harmless."""
        with self._lock:
            self._is_closed = True
            waiting_requests = list(self._requests)
            self._requests.clear()
            self._requests_by_key.clear()
        for request in waiting_requests:
            # A request that has begun is marked as running already, and a future is marked only once.
            if request.pieces is not None or request.future.set_running_or_notify_cancel():
                request.future.set_exception(_make_closed_error())

    def _take_next(self) -> _QueuedRequest | None:
        with self._lock:
            if not self._requests:
                return None
            request = self._requests.popleft()
            if request.key is not None:
                self._requests_by_key.pop(request.key, None)
            return request


def _make_closed_error() -> ApiError:
    return ApiError(503, "The daemon is stopping")


def _carry_out(request: _QueuedRequest, is_late: Callable[[], bool]) -> bool:
    """Carry out a request, or its pieces until ``is_late``; return whether the request is finished."""
    if request.pieces is None and not request.future.set_running_or_notify_cancel():
        return True  # the future was cancelled, so no client waits for the result
    try:
        result = request.function() if request.pieces is None else request.pieces
        if isinstance(result, Generator):
            request.pieces = result
            while not is_late():
                next(result)
            return False
    except StopIteration as stop:
        request.future.set_result(stop.value)
    except Exception as error:  # noqa: BLE001 - reported to the client
        request.future.set_exception(error)
    else:
        request.future.set_result(result)
    return True
