"""The queue of the web server's questions to the main loop."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Generator
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, Final

MOST_WAITING: Final = 64  # limit of waiting questions

SHARE: Final = 0.1  # largest share of the loop's time for the web server

# The longest pause between answers in seconds; otherwise a two-second reset would delay clients by 18 s.
MOST_REST_S: Final = 1.0

LONG_S: Final = 0.005  # seconds after which no further question is answered in the same loop


class QueueClosedError(Exception):
    """The queue is closed and answers no requests."""


class RequestQueueFullError(Exception):
    """The limit of waiting questions is reached."""


@dataclass(slots=True)
class _QueuedRequest:
    look: Callable[[], Any]
    key: object
    answer: Future[Any] = field(default_factory=Future)
    pieces: Generator[None, None, Any] | None = None


class RequestQueue:
    """Passes questions of any thread to the thread that calls :meth:`poll`.

    :param now: the clock for durations in seconds.
    """

    def __init__(self, now: Callable[[], float] = time.perf_counter) -> None:
        self._now = now
        self._lock = threading.Lock()
        self._waiting: deque[_QueuedRequest] = deque()
        self._by_key: dict[object, _QueuedRequest] = {}
        self._closed = False
        self._rest_until = 0.0

    def ask(self, look: Callable[[], Any], key: object = None) -> Future[Any]:
        """Queue a call of ``look`` in the main loop and return the future answer.

        A generator runs in pieces: it continues in the same or a later loop after each ``yield``, and its
        return value is the answer.

        :param key: waiting questions with the same key share one call; None to never share.
        :raises RequestQueueFullError: if too many questions wait.
        :raises QueueClosedError: if the queue is closed.
        """
        with self._lock:
            if self._closed:
                raise QueueClosedError
            pending = None if key is None else self._by_key.get(key)
            if pending is not None:
                return pending.answer
            if len(self._waiting) >= MOST_WAITING:
                raise RequestQueueFullError
            question = _QueuedRequest(look, key)
            self._waiting.append(question)
            if key is not None:
                self._by_key[key] = question
            return question.answer

    def poll(self) -> None:
        """Answer waiting questions in bounded time. Called once a loop by the main loop's thread."""
        if not self._waiting:
            return
        start = self._now()
        if start < self._rest_until:
            return

        def is_late() -> bool:
            return self._now() - start >= LONG_S

        while (question := self._next()) is not None:
            if not _answer(question, is_late):
                self._put_back(question)
            if is_late():
                break
        end = self._now()
        # a pause of 9 times the work keeps the web server at its share of the loop's time
        self._rest_until = end + min((end - start) * (1 / SHARE - 1), MOST_REST_S)

    def _put_back(self, question: _QueuedRequest) -> None:
        """Queue an unfinished question again behind shorter ones."""
        with self._lock:
            if not self._closed:
                self._waiting.append(question)
                return
        question.answer.set_exception(QueueClosedError())

    def close(self) -> None:
        """Reject waiting and later questions; repeated calls are harmless."""
        with self._lock:
            self._closed = True
            waiting = list(self._waiting)
            self._waiting.clear()
            self._by_key.clear()
        for question in waiting:
            if question.pieces is not None or question.answer.set_running_or_notify_cancel():
                question.answer.set_exception(QueueClosedError())

    def _next(self) -> _QueuedRequest | None:
        with self._lock:
            if not self._waiting:
                return None
            question = self._waiting.popleft()
            if question.key is not None:
                self._by_key.pop(question.key, None)
            return question


def _answer(question: _QueuedRequest, is_late: Callable[[], bool]) -> bool:
    """Answer a question; return whether it is finished. A question in pieces stops when it is late."""
    answer = question.answer
    if question.pieces is None and not answer.set_running_or_notify_cancel():
        return True  # the client has disconnected
    try:
        result = question.look() if question.pieces is None else question.pieces
        if isinstance(result, Generator):
            question.pieces = result
            while not is_late():
                next(result)
            return False
    except StopIteration as end:
        answer.set_result(end.value)
    except Exception as error:  # noqa: BLE001 - reported to the client
        answer.set_exception(error)
    else:
        answer.set_result(result)
    return True
