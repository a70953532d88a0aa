"""The queue of requests to the main loop: order, bounds and share of time."""

from __future__ import annotations

import pytest

from cxbridge_web.endpoint import ApiError
from cxbridge_web.request_queue import MAX_WAITING_REQUESTS, RequestQueue


class FakeTime:
    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def test_requests_are_answered_by_poll():
    queue = RequestQueue(FakeTime())
    answers = [queue.submit(lambda: 1), queue.submit(lambda: 1 // 0)]
    assert not any(answer.done() for answer in answers)
    queue.poll()
    assert answers[0].result(0) == 1
    assert isinstance(answers[1].exception(0), ZeroDivisionError)


def test_equal_waiting_requests_run_once():
    queue, calls = RequestQueue(FakeTime()), []
    first, second = (queue.submit(lambda: calls.append(1), "key") for _ in range(2))
    assert first is second
    queue.poll()
    later = queue.submit(lambda: calls.append(2), "key")
    assert later is not first
    queue.poll()
    assert calls == [1, 2]


@pytest.mark.parametrize(("work_s", "pause_s"), [(0.02, 0.18), (2.0, 1.0)])
def test_pause_follows_long_request(work_s, pause_s):
    """The pause has nine times the length of the request, but at most 1 s: longer pauses cause status 503."""
    time = FakeTime()
    queue = RequestQueue(time)

    def work():
        time.now += work_s

    queue.submit(work)
    answer = queue.submit(lambda: 1)
    for elapsed_s in (0.0, pause_s - 0.001):
        time.now += elapsed_s
        queue.poll()
        assert not answer.done()
    time.now += 0.002
    queue.poll()
    assert answer.result(0) == 1


def run_in_pieces(time, cost, count, done):
    for number in range(count):
        time.now += cost
        done.append(number)
        yield
    return "all"


def test_request_in_pieces_yields_to_loop():
    time = FakeTime()
    done: list[int] = []
    queue = RequestQueue(time)
    answer = queue.submit(lambda: run_in_pieces(time, 0.002, 9, done))
    turns = 0
    while not answer.done():
        before = len(done)
        queue.poll()
        turns += len(done) > before
        time.now += 0.01
    assert (answer.result(0), done, turns) == ("all", list(range(9)), 3)


def test_short_request_does_not_wait_for_request_in_pieces():
    time = FakeTime()
    done: list[int] = []
    queue = RequestQueue(time)
    long = queue.submit(lambda: run_in_pieces(time, 0.01, 5, done))
    short = queue.submit(lambda: 1)
    queue.poll()
    assert (done, short.done()) == ([0], False)
    time.now += 1
    queue.poll()
    assert (done, short.result(0), long.done()) == ([0, 1], 1, False)


def test_failed_and_closed_requests_have_errors():
    time = FakeTime()

    def failing():
        yield
        raise ValueError

    queue = RequestQueue(time)
    failed = queue.submit(failing)
    queue.poll()
    assert isinstance(failed.exception(0), ValueError)
    time.now += 1
    closed = queue.submit(lambda: run_in_pieces(time, 0.01, 5, []))
    queue.poll()
    waiting = queue.submit(lambda: 1, "key")
    queue.close()
    assert [str(each.exception(0)) for each in (closed, waiting)] == ["The daemon is stopping"] * 2
    with pytest.raises(ApiError, match="stopping"):
        queue.submit(lambda: 1)


def test_queue_refuses_requests_beyond_limit():
    queue = RequestQueue(FakeTime())
    for _ in range(MAX_WAITING_REQUESTS):
        queue.submit(lambda: None)
    with pytest.raises(ApiError, match="Too many"):
        queue.submit(lambda: None)
