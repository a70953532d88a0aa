"""Questions to the main loop: order, bounds, and the share of its time."""

from __future__ import annotations

from functools import partial

import pytest

from cxbridge.web.desk import MOST_WAITING, Desk, DeskClosedError, DeskFullError


class Watch:
    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def test_questions_are_answered_when_the_loop_attends():
    desk = Desk()
    answers = [desk.ask(lambda: 1), desk.ask(lambda: 1 // 0)]
    assert not any(answer.done() for answer in answers)
    desk.attend()
    assert answers[0].result(0) == 1
    assert isinstance(answers[1].exception(0), ZeroDivisionError)


def test_equal_questions_that_wait_are_asked_once():
    desk, asked = Desk(Watch()), []
    first, second = (desk.ask(lambda: asked.append(1), "key") for _ in range(2))
    assert first is second
    desk.attend()
    later = desk.ask(lambda: asked.append(2), "key")
    assert later is not first
    desk.attend()
    assert asked == [1, 2]


def test_a_long_answer_ends_the_turn_and_the_loop_has_nine_tenths_of_the_time():
    watch, done = Watch(), []
    desk = Desk(watch)

    def long():
        watch.now += 0.02
        done.append(watch.now)

    for _ in range(2):
        desk.ask(long)
    desk.attend()
    assert len(done) == 1
    watch.now = 0.199
    desk.attend()
    assert len(done) == 1
    watch.now = 0.201
    desk.attend()
    assert len(done) == 2


def test_after_a_very_long_answer_nobody_waits_nine_times_as_long():
    """After a reset that took 2 s all questions of 18 s were 503."""
    watch = Watch()
    desk = Desk(watch)

    def reset():
        watch.now += 2.0

    desk.ask(reset)
    desk.attend()
    answer = desk.ask(lambda: 1)
    watch.now += 0.99
    desk.attend()
    assert not answer.done()
    watch.now += 0.02
    desk.attend()
    assert answer.result(0) == 1


def test_short_answers_share_a_turn():
    done: list[int] = []
    desk = Desk(Watch())
    for number in range(MOST_WAITING):
        desk.ask(partial(done.append, number))
    desk.attend()
    assert done == list(range(MOST_WAITING))


def test_not_too_many_may_wait():
    desk = Desk()
    for _ in range(MOST_WAITING):
        desk.ask(lambda: None)
    with pytest.raises(DeskFullError):
        desk.ask(lambda: None)


def test_nobody_waits_for_ever_when_it_is_closed():
    desk = Desk()
    answer = desk.ask(lambda: 1, "key")
    desk.close()
    assert isinstance(answer.exception(0), DeskClosedError)
    with pytest.raises(DeskClosedError):
        desk.ask(lambda: 1)


def test_an_answer_that_nobody_waits_for_is_not_made():
    desk, asked = Desk(Watch()), []
    desk.ask(lambda: asked.append(1)).cancel()
    desk.attend()
    assert asked == []
