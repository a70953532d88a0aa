"""The scan of CLIPS text and the rewriting of `modify`."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.executive.host.source import SourceConstruct, prepare_core_source, prepare_source


def rewritten(text: str) -> str:
    return re.sub(" +", " ", prepare_source(text).text)


@pytest.mark.parametrize(
    ("text", "becomes"),
    [
        ("(modify ?f (mode A))", "(cx-modify ?f mode (create$ A))"),
        (
            "(modify ?f (a) (b 1 2) (c $?x (+ 1 2)))",
            "(cx-modify ?f a (create$) b (create$ 1 2) c (create$ $?x (+ 1 2)))",
        ),
        ("(modify (nth$ 1 ?fs) (a 1))", "(cx-modify (nth$ 1 ?fs) a (create$ 1))"),
        (
            "(modify ?f (a (progn (modify ?g (b 1)) 2)) (c 3))",
            "(cx-modify ?f a (create$ (progn (cx-modify ?g b (create$ 1)) 2)) c (create$ 3))",
        ),
        ('(printout t "(modify ?f (a 1))") ; (modify ?f (a 1))\n',) * 2,
        ("(modify-instance x) (modifying (a 1))",) * 2,
        (
            "(modify ?f ; why\n (a 1) ; (b 2)\n (c 3))",
            "(cx-modify ?f ; why\n a (create$ 1) ; (b 2)\n c (create$ 3))",
        ),
        ("(; first\n modify ?f (; second\n a 1))", "(\ncx-modify ?f \n a (create$ 1))"),
        ("(duplicate 1 (a 1 2))", "(cx-duplicate 1 a (create$ 1 2))"),
    ],
)
def test_modify_and_duplicate_become_calls_of_host(text: str, becomes: str):
    assert rewritten(text) == becomes


def test_comment_between_parenthesis_and_keyword():
    assert prepare_source("(defrule ; why\n a =>)").constructs == (SourceConstruct("defrule", "a", 1),)


@given(
    st.lists(st.sampled_from(["(modify ?f", "(a", ")", "1", "\n", '"x(', '"', "; c\n", "(defrule r", " "]))
)
def test_rewriting_keeps_line_numbers(parts):
    text = " ".join(parts)
    assert rewritten(text).count("\n") == text.count("\n")


def test_constructs_and_their_lines():
    rule = '(defrule a\n => (printout t "(defrule x)"))'
    text = f"; head\n{rule}\n\n  (deffunction MAIN::b () 1)(defglobal ?*c* = 1)"
    source = prepare_source(text)
    assert source.constructs == (
        SourceConstruct("defrule", "a", 2),
        SourceConstruct("deffunction", "MAIN::b", 5),
        SourceConstruct("defglobal", "?*c*", 5),
    )


def test_command_behind_defglobal_is_separate():
    text = "(defglobal ?*a* = 1 ?*b* = 2) (bind ?*c* = 3)"
    names = [construct.name for construct in prepare_source(text).constructs]
    assert names == ["?*a*", "?*b*"]


def test_unclosed_parenthesis_is_found_at_opening():
    source = prepare_source("(defrule a =>)\n(defrule b\n => (x)\n(defrule c =>)\n")
    assert source.unclosed_line == 2


def test_balanced_text_has_no_unclosed_line():
    assert prepare_source('(a "(" (b)) ; (\n').unclosed_line is None


def test_modify_goal_of_core_uses_modify_of_6_30():
    text = "(defrule a => (modify ?a (x 1)) (cx-modify-goal ?g (mode A) (error)))"
    core = prepare_core_source(text)
    expected = "(defrule a => (modify ?a (x 1)) (cx-modify ?g mode (create$ A) error (create$)))"
    assert re.sub(" +", " ", core.text) == expected
    assert re.sub(" +", " ", rewritten("(cx-modify-goal ?g (mode A))")) == "(cx-modify ?g mode (create$ A))"
