"""The parser of conditions."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.clipstext.syntax import compact, read_nodes
from cxbridge.errors import ClipsError
from cxbridge_studio.agent import condition
from cxbridge_studio.agent.condition import GroupCE, PatternCE
from cxbridge_studio.agent.rule import parse_rule
from tests.support import many


def parse_first_pattern(text: str) -> PatternCE:
    """Return the first pattern of a condition."""
    pattern = parse_rule(f"(defrule r {text} =>)").ces[0]
    assert isinstance(pattern, PatternCE)
    return pattern


def test_rule_is_parsed():
    rule = parse_rule(
        '(defrule MAIN::r "what => for" ; comment => (\n (declare (salience (+ 1 ?*s*)) (auto-focus TRUE))\n'
        " ?f <- (a (x ?x&~?y|3)) (and (b) (c)) (logical (d)) (not (e)) (test (> ?x 1))"
        " (or ?g <- (f) (and (g) (h))) => (assert (i)))"
    )
    assert rule.rule == "r"
    assert rule.salience == "(+ 1 ?*s*)"
    assert rule.globals == {"s"}
    assert [type(ce) for ce in rule.ces] == [
        PatternCE,
        PatternCE,
        PatternCE,
        PatternCE,
        GroupCE,
        condition.TestCE,
        GroupCE,
    ]
    branches = rule.ces[-1]
    assert isinstance(branches, GroupCE)
    assert [branch.text for branch in branches.items] == ["?g <- (f)", "(and (g) (h))"]


def test_restricted_text_has_parts_that_bind_variables():
    pattern = parse_first_pattern("(a (x ?x&c) (y ?y) (z ?z&:(> ?z ?x)&~?w))")
    foreign = frozenset("w")
    assert [pattern.restricted_text(part, foreign) for part in pattern.constraints] == [
        "(a (x ?x&c))",
        "(a (y ?y))",
        "(a (x ?x) (z ?z&:(> ?z ?x)&~?w))",
    ]
    # ?x|c compares the field with the value of ?x
    assert parse_first_pattern("(a (x ?x|c))").bound_variables == frozenset()
    assert [part.label for part in pattern.find_restrictive_constraints(foreign)] == ["x", "z"]
    assert [part.label for part in pattern.find_restrictive_constraints(frozenset("y"))] == ["x", "y", "z"]


def test_parts_of_ordered_fact_are_fields():
    pattern = parse_first_pattern("(o ?x b ?x)")
    assert [part.label for part in pattern.find_restrictive_constraints(frozenset())] == [
        "field 2",
        "field 3",
    ]
    assert pattern.restricted_text(pattern.constraints[1], frozenset()) == "(o ? b ?)"
    assert pattern.restricted_text(pattern.constraints[2], frozenset()) == "(o ?x ? ?x)"


@pytest.mark.parametrize("text", ["", "x", "(defrule)", "(defrule r", "(defrule r (a))", "(deffacts r (a))"])
def test_text_without_rule_is_refused(text):
    with pytest.raises(ClipsError):
        parse_rule(text)


WORDS = '( ) (defrule\tr => " \\ ; & | ~ <- ?x $? ?*g* : = (not (or (test (declare a (goal (class é \0'
PIECES = st.lists(st.sampled_from([*WORDS.split(" "), " ", "\n", "(deftemplate t ", "(defglobal "]))


@settings(max_examples=many(500, 125), deadline=None)
@given(PIECES.map("".join))
def test_arbitrary_text_is_read_without_fault(text):
    for node in read_nodes(text):
        assert text[node.start : node.end] == node.text
    compact(text)
    with suppress(ClipsError):
        parse_rule(text)
    with suppress(ClipsError):
        parse_rule(f"(defrule r {text} =>)")


def test_deep_nesting_is_an_error():
    assert compact(read_nodes("(" * 5000 + ")" * 5000)[0].text).startswith("((((")
    with pytest.raises(ClipsError, match="nested too deep"):
        parse_rule(f"(defrule r {'(and ' * 5000}{')' * 5000} =>)")


def test_arrow_before_word_is_no_pattern():
    assert parse_rule("(defrule r ?f <- a =>)").ces == ()
