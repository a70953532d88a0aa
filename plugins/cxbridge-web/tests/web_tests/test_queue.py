"""Questions to the main loop: order, bounds, and the share of its time."""

from __future__ import annotations

import pytest

from cxbridge_web.endpoint import ApiError
from cxbridge_web.queue import MAX_WAITING_REQUESTS, RequestQueue


class Watch:
    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def test_questions_are_answered_when_the_loop_attends():
    queue = RequestQueue(Watch())
    answers = [queue.submit(lambda: 1), queue.submit(lambda: 1 // 0)]
    assert not any(answer.done() for answer in answers)
    queue.poll()
    assert answers[0].result(0) == 1
    assert isinstance(answers[1].exception(0), ZeroDivisionError)


def test_equal_questions_that_wait_are_asked_once():
    queue, asked = RequestQueue(Watch()), []
    first, second = (queue.submit(lambda: asked.append(1), "key") for _ in range(2))
    assert first is second
    queue.poll()
    later = queue.submit(lambda: asked.append(2), "key")
    assert later is not first
    queue.poll()
    assert asked == [1, 2]


@pytest.mark.parametrize(("work_s", "pause_s"), [(0.02, 0.18), (2.0, 1.0)])
def test_a_long_request_is_followed_by_a_pause(work_s, pause_s):
    """Nine times as long, but at most 1 s: after a reset of 2 s all questions of 18 s were 503."""
    watch = Watch()
    queue = RequestQueue(watch)

    def work():
        watch.now += work_s

    queue.submit(work)
    answer = queue.submit(lambda: 1)
    for elapsed_s in (0.0, pause_s - 0.001):
        watch.now += elapsed_s
        queue.poll()
        assert not answer.done()
    watch.now += 0.002
    queue.poll()
    assert answer.result(0) == 1


def in_pieces(watch, cost, count, done):
    for number in range(count):
        watch.now += cost
        done.append(number)
        yield
    return "all"


def test_an_answer_in_pieces_leaves_the_loop_in_between():
    watch = Watch()
    done: list[int] = []
    queue = RequestQueue(watch)
    answer = queue.submit(lambda: in_pieces(watch, 0.002, 9, done))
    turns = 0
    while not answer.done():
        before = len(done)
        queue.poll()
        turns += len(done) > before
        watch.now += 0.01
    assert (answer.result(0), done, turns) == ("all", list(range(9)), 3)


def test_a_short_answer_does_not_wait_for_one_in_pieces():
    watch = Watch()
    done: list[int] = []
    queue = RequestQueue(watch)
    long = queue.submit(lambda: in_pieces(watch, 0.01, 5, done))
    short = queue.submit(lambda: 1)
    queue.poll()
    assert (done, short.done()) == ([0], False)
    watch.now += 1
    queue.poll()
    assert (done, short.result(0), long.done()) == ([0, 1], 1, False)


def test_pieces_that_fail_and_those_of_a_desk_that_closes_are_told():
    watch = Watch()

    def failing():
        yield
        raise ValueError

    queue = RequestQueue(watch)
    failed = queue.submit(failing)
    queue.poll()
    assert isinstance(failed.exception(0), ValueError)
    watch.now += 1
    closed = queue.submit(lambda: in_pieces(watch, 0.01, 5, []))
    queue.poll()
    waiting = queue.submit(lambda: 1, "key")
    queue.close()
    assert [str(each.exception(0)) for each in (closed, waiting)] == ["The daemon is stopping"] * 2
    with pytest.raises(ApiError, match="stopping"):
        queue.submit(lambda: 1)


def test_not_too_many_may_wait():
    queue = RequestQueue(Watch())
    for _ in range(MAX_WAITING_REQUESTS):
        queue.submit(lambda: None)
    with pytest.raises(ApiError, match="Too many"):
        queue.submit(lambda: None)
