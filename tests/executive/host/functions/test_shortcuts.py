"""Functions of Fawkes' core that take a shortcut answer as they do without."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path

import pytest

from cxbridge.clipstext.syntax import blank, top_level
from cxbridge.clock import make_clock
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.functions.shortcuts import shortcut_at
from cxbridge.executive.host.source import prepare

CORE = "src/plugins/clips-executive/clips/worldmodel.clp"
NAME = "wm-key-prefix"


def _function() -> str:
    folder = os.environ.get("FAWKES_DIR")
    if not folder:
        pytest.skip("FAWKES_DIR names no checkout of Fawkes")
    text = (Path(folder) / CORE).read_text()
    code = blank(text)
    for start, end in top_level(code):
        if code.startswith(f"(deffunction {NAME} ", start):
            return text[start:end]
    raise AssertionError(f"{CORE} defines no {NAME}")


@contextmanager
def closing_environment() -> Iterator[ClipsEnvironment]:
    env = ClipsEnvironment("test", EventBus(make_clock("virtual")))
    try:
        yield env
    finally:
        env.destroy()


def test_the_shortcut_gives_the_same_answers_as_the_function_of_fawkes():
    text = _function()
    short = prepare(text, rewrite_modify=True).text
    assert short != text
    words = ("", "a", "b", "1", "1.0", '"a"', "a b", "b a", "a a", "a b a", "a b b", 'a "b"', "args? a")
    with closing_environment() as env:
        env.build_unrecorded(text.replace(NAME, "plain", 1))
        env.build_unrecorded(short.replace(NAME, "shortened", 1))
        for key, prefix in product(words, words):
            call = f"(create$ {key}) {prefix}"
            assert env.eval(f"(shortened {call})") == env.eval(f"(plain {call})"), call
            call = f"(create$ {key}) (create$ {prefix})"
            assert env.eval(f"(shortened {call})") == env.eval(f"(plain {call})"), call


def test_a_function_of_that_name_with_other_code_stays_as_it_is():
    text = f"(deffunction {NAME} (?key $?prefix) (return FALSE))"
    assert shortcut_at(text, 0, len(text)) is None
    assert prepare(text, rewrite_modify=True).text == text


def test_other_words_in_its_comments_make_no_difference():
    text = _function().replace('"Check if', '"See if')
    code = blank(text)
    assert shortcut_at(code, 0, len(code)) is not None
