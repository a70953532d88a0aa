"""CLIPS source text: tokens, lists, constructs."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.clipstext.syntax import (
    TOKEN,
    Lines,
    blank,
    compact,
    definitions,
    read_nodes,
    rule_lines,
    top_level_lists,
)

PIECES = st.lists(
    st.sampled_from([*'()"\\;&|~<-?x=*a\n \0é', "(defrule r", "(defrule MAIN::s", '"a\\"b"', "; c\n"])
)
texts = PIECES.map("".join)


@given(texts)
def test_each_character_belongs_to_one_token(text):
    assert "".join(match.group() for match in TOKEN.finditer(text)) == text


@given(texts)
def test_the_quick_ways_and_the_reader_agree(text):
    code = blank(text)
    assert len(code) == len(text)
    assert code.count("\n") == text.count("\n")
    assert not set(code) & set('";')
    lists = [(node.start, node.end) for node in read_nodes(text) if node.items is not None]
    closed = [(start, end) for start, end in top_level_lists(code) if end is not None]
    if len(closed) == sum(1 for _ in top_level_lists(code)):
        assert closed == lists
        rules = {each.name: each.line for each in definitions(text) if each.kind == "defrule"}
        assert rule_lines(text).items() <= rules.items()


@given(texts, st.integers(0, 40))
def test_lines_are_counted_from_one(text, place):
    assert Lines(text).line_at(place) == text.count("\n", 0, place) + 1


@pytest.mark.parametrize("text", ['(a "b', '(a "b \\" (c)', '(a "b \\'])
def test_a_string_that_never_closes_goes_on_to_the_end(text):
    """One that ended in a backslash was taken for code."""
    assert blank(text).strip() == "(a"
    assert [match.lastgroup for match in TOKEN.finditer(text)][-1] == "unclosed"


def test_text_on_one_line():
    assert compact('( a ; comment\n  "b  c"\n  (d )\n)') == '(a "b  c" (d))'


def test_constructs_of_a_file():
    text = '; head\n(defrule MAIN::a "why" => (x))\n\n(deftemplate b) (goal)(defrule a\n=>)(defrule c'
    found = [(each.kind, each.name, each.line) for each in definitions(text)]
    assert found == [("defrule", "a", 2), ("deftemplate", "b", 4), ("defrule", "a", 4)]
    assert rule_lines(text) == {"a": 4, "c": 5}
