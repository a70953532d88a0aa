"""The check names the unclosed lists of a construct."""

from __future__ import annotations

import pytest

from cxbridge.run import RunOptions
from cxbridge_studio.agent.unclosed import find_unclosed_lists
from cxbridge_studio.check.run import check
from studio_tests.check.deletions import SCENARIOS, compute_figure

GOAL = {"goal": {"id", "class", "mode", "params"}}


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("(defrule r\n  (goal (id ?id)\n  =>\n  (halt))", "(goal"),
        ("(defrule r\n  (goal (id ?id (class A))\n  =>\n  (halt))", "(id"),
        ("(defrule r\n  (goal (class A)\n        (mode B)\n  (goal (id 1))\n  =>\n  (halt))", "(goal (class"),
        ("(deffunction f (?a)\n  (if (eq ?a 1 then\n    (return 2)))", "(eq"),
        ("(defrule r\n  =>\n  (bind ?x (+ 1 2)\n  (assert (goal (id ?x))))", "(bind"),
        ("(deftemplate t (slot a (type SYMBOL) (slot b))", "(slot a"),
        ("(defrule r\n  (goal (id 1)\n  (goal (mode A)\n  =>\n  (halt))", "(goal (id|(goal (mode"),
        ("(defrule r\n  (goal (id 1))\n  =>\n  (halt)", "(defrule"),
        ("(deffunction f (?f)\n  (modify ?f (length$ (id 1))) (halt)", "(deffunction"),
    ],
)
def test_unclosed_lists_are_found(text: str, named: str) -> None:
    open_texts = [text[at:] for at in find_unclosed_lists(text, GOAL)]
    assert len(open_texts) == text.count("(") - text.count(")")
    assert all(any(part.startswith(name) for part in open_texts) for name in named.split("|"))


def test_closed_text_has_no_unclosed_lists() -> None:
    assert find_unclosed_lists("(defrule r => (halt))") == []


def test_right_list_is_named_after_95_percent_of_deletions() -> None:
    result = compute_figure(SCENARIOS)
    assert result.total > 1300
    assert result.right >= 0.95 * result.total > 3 * result.innermost


def test_unclosed_string_is_named_at_its_quote(tmp_path):
    file = tmp_path / "agent.clp"
    rule = '(defrule a "A rule."\n  (x)\n  =>\n  (assert (shelf "a"))\n  (assert (shelf "b")))\n'
    for literal, line in (('"a"', 4), ('"b"', 5)):
        file.write_text(f"{rule.replace(literal, literal[:-1])}(defrule b (x) =>)\n")
        (finding,) = (finding for finding in check(RunOptions(scenario=file)) if finding.code.name == "CX201")
        assert finding.place.line == line
        assert "defrule a never closes: its string is open" in finding.message
        assert finding.hint == f'a " is missing in line {line} or before line 6'
