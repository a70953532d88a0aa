"""Questions of the web server, answered by the main loop when it has time."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Generator
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, Final

MOST_WAITING: Final = 64
"""Questions that may wait."""

SHARE: Final = 0.1
"""The part of its time that the loop gives the web at most."""

MOST_REST_S: Final = 1.0
"""Seconds without an answer at most: after a reset of two seconds, no client waits for eighteen."""

LONG_S: Final = 0.005
"""After which no further question is taken in the same loop."""


class QueueClosedError(Exception):
    """The queue is closed: requests get no answer."""


class RequestQueueFullError(Exception):
    """Too many questions wait already."""


@dataclass(slots=True)
class _QueuedRequest:
    look: Callable[[], Any]
    key: object
    answer: Future[Any] = field(default_factory=Future)
    pieces: Generator[None, None, Any] | None = None


class RequestQueue:
    """Takes questions of any thread to the thread that calls :meth:`poll`.

    :param now: seconds, for how long things take.
    """

    def __init__(self, now: Callable[[], float] = time.perf_counter) -> None:
        self._now = now
        self._lock = threading.Lock()
        self._waiting: deque[_QueuedRequest] = deque()
        self._by_key: dict[object, _QueuedRequest] = {}
        self._closed = False
        self._rest_until = 0.0

    def ask(self, look: Callable[[], Any], key: object = None) -> Future[Any]:
        """Have ``look`` called by the loop, and return where its answer will be.

        A function that returns a generator is run in pieces: the generator continues in the same loop or a
        later one after each ``yield``, and its return value is the answer.

        :param key: of questions with the same key that wait one is asked, for all. None: never.
        :raises QueueFullError: when too many wait.
        :raises QueueClosedError: when it is closed.
        """
        with self._lock:
            if self._closed:
                raise QueueClosedError
            known = None if key is None else self._by_key.get(key)
            if known is not None:
                return known.answer
            if len(self._waiting) >= MOST_WAITING:
                raise RequestQueueFullError
            question = _QueuedRequest(look, key)
            self._waiting.append(question)
            if key is not None:
                self._by_key[key] = question
            return question.answer

    def poll(self) -> None:
        """Answer what waits, in bounded time. Called once a loop, by the main loop's thread."""
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
        self._rest_until = end + min((end - start) * (1 / SHARE - 1), MOST_REST_S)

    def _put_back(self, question: _QueuedRequest) -> None:
        """Let an unfinished question wait behind the rest: short questions need not wait for it."""
        with self._lock:
            if not self._closed:
                self._waiting.append(question)
                return
        question.answer.set_exception(QueueClosedError())

    def close(self) -> None:
        """Refuse waiting and later questions. A second call does nothing."""
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
    """Answer a question; return whether it is done. A question in pieces is left when it becomes late."""
    answer = question.answer
    if question.pieces is None and not answer.set_running_or_notify_cancel():
        return True  # the client has given up
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
