"""The lexical layer: words, groups, positions, and brackets that do not match."""

from __future__ import annotations

import re
import time

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.errors import PddlError
from cxbridge.executive.pddl.brackets import BracketWord, Group, read_items
from cxbridge.executive.pddl.tokens import MAX_DEPTH
from tests.support import many

patient = settings(max_examples=many(100, 25), deadline=None, suppress_health_check=[HealthCheck.too_slow])


def shape(item: BracketWord | Group) -> object:
    return item.text if isinstance(item, BracketWord) else [shape(child) for child in item.items]


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("(a))", (1, 4), "one ')' too many"),
        ("(a (b)\n", (1, 1), "never closed"),
        ("(a)\n(b (c", (2, 4), "never closed"),
        ("(define (:action x :effect (and (p)))", (1, 1), "never closed"),
        ("(define (:types a)\n(:action x :effect (p)\n(:action y))", (3, 1), "missing before '(:action'"),
    ],
)
def test_unbalanced_brackets_are_an_error(text: str, place: tuple[int, int], message: str) -> None:
    with pytest.raises(PddlError, match=re.escape(message)) as caught:
        read_items(text, "d.pddl")
    assert (caught.value.line, caught.value.column) == place
    assert caught.value.file == "d.pddl"


def test_deep_nesting_is_quick_error() -> None:
    start = time.process_time()
    for text in (
        "(" * 10_000 + ")" * 10_000,
        "(" * 10_000,
        "(a " * 10_000 + ")" * 10_000,
        ")" * 10_000,
        "(" * 1_000_000,
    ):
        with pytest.raises(PddlError):
            read_items(text)
    assert time.process_time() - start < 5


def test_maximum_depth_is_allowed() -> None:
    assert read_items("(" * MAX_DEPTH + ")" * MAX_DEPTH)
    with pytest.raises(PddlError, match="nested more than") as caught:
        read_items("; ((\n" + "(" * (MAX_DEPTH + 1) + ")" * (MAX_DEPTH + 1))
    assert (caught.value.line, caught.value.column) == (2, MAX_DEPTH + 1)


@patient
@given(st.text(alphabet="(ab;\n )", max_size=40))
def test_random_text_reads_or_is_one_error(text: str) -> None:
    code = "\n".join(line.split(";")[0] for line in text.split("\n"))
    balance = lowest = 0
    for character in code:
        balance += {"(": 1, ")": -1}.get(character, 0)
        lowest = min(lowest, balance)
    if balance == lowest == 0:
        assert "".join(str(shape(item)) for item in read_items(text)).count("[") == code.count("(")
    else:
        with pytest.raises(PddlError):
            read_items(text)
