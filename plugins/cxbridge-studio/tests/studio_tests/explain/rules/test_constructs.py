"""Constructs of files."""

from __future__ import annotations

from hypothesis import given, settings

from cxbridge.executive.host.loading import Diagnostic
from cxbridge_studio.explain.rules.constructs import Constructs, TextFile
from cxbridge_studio.explain.rules.diagnoser import diagnose
from cxbridge_studio.explain.rules.matcher import Matcher
from studio_tests.agent.test_rule import PIECES
from tests.support import many


@settings(max_examples=many(100, 25), deadline=None)
@given(PIECES.map("".join))
def test_arbitrary_text_is_read_without_fault(text):
    Constructs([TextFile("a.clp", text)])


def test_function_comes_after_its_callees():
    """In the wrong order, CLIPS refuses a condition with calls of a function and of its callee."""
    text = """
        (deffunction c (?x) (+ ?x 1)) (deffunction a (?x) (c ?x))
        (defrule r (test (and (a 1) (c 1))) =>)"""
    snapshot = Constructs([TextFile("1.clp", text)]).take_snapshot("r", "e", 0)
    assert [function.split()[1] for function in snapshot.functions] == ["c", "a"]
    assert diagnose(snapshot).unknown == ""


def test_later_construct_replaces_earlier_construct_with_its_name():
    constructs = Constructs(
        [
            TextFile("1.clp", "(defglobal ?*a* = 1 ?*b* = (+ ?*a* 1))\n(defrule r (x) =>)"),
            TextFile(
                "2.clp",
                '\n(defrule MAIN::r "late" (y ?*b*) =>)\n(deftemplate MAIN::y (field z) (multifield w))',
            ),
        ]
    )
    snapshot = constructs.take_snapshot("r", "e", 0)
    assert not snapshot.needs_all_facts
    with Matcher(snapshot) as matcher:
        assert matcher.count(["(test (= ?*b* 2))"]).number == 1
    assert constructs.rulebook.positions == {"r": ("2.clp", 2)}
    assert snapshot.templates["y"].slots == (("z", False), ("w", True))


def test_refused_rule_is_not_in_rulebook():
    text = "(defrule r (a) =>)"
    diagnostic = Diagnostic("a.clp", 1, "defrule r", "EXPRNPSR3", "Missing function")
    rulebook = Constructs([TextFile("a.clp", text)], [diagnostic]).rulebook
    assert not rulebook.rules
    assert rulebook.refused_texts == {"r": text}
