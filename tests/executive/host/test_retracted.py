"""Slots that rules read after retraction. tests/executive/clips630 compares them with CLIPS 6.30."""

from __future__ import annotations

import pytest

from cxbridge.executive.host.retracted import find_retracted_slot_edits
from cxbridge.executive.host.source import prepare_source

TEMPLATE = (
    "(deftemplate item (slot name) (multislot tags))\n(deffacts start (item (name a) (tags 1 2)) (go))\n"
)
KEPT = "(bind ?cx-i-tags ?i:tags) (bind ?cx-i-name ?i:name)"


def rewritten(body):
    text = f"(defrule r (go) => (do-for-fact ((?i item)) TRUE {body}))"
    return prepare_source(text).text.partition("TRUE ")[2][:-2]


@pytest.mark.parametrize(
    ("body", "becomes"),
    [
        ("(retract ?i) (f ?i:name)", "(bind ?cx-i-name ?i:name) (retract ?i) (f ?cx-i-name)"),
        ("(f ?i:name) (retract ?i)", "(f ?i:name) (retract ?i)"),
        ("(retract ?i) (f ?i)", "(retract ?i) (f ?i)"),
        ("(retract ?j) (f ?i:name)", "(retract ?j) (f ?i:name)"),
        ('(retract ?i) (f "?i:name") ; ?i:name\n', '(retract ?i) (f "?i:name") ; ?i:name\n'),
        (
            "(if ?x then (retract ?i))\n(f ?i:tags ?i:name ?i:tags)",
            f"{KEPT} (if ?x then (retract ?i))\n(f ?cx-i-tags ?cx-i-name ?cx-i-tags)",
        ),
    ],
)
def test_slots_are_read_before_retraction(body, becomes):
    assert rewritten(body) == becomes


def test_slots_are_read_before_modify():
    assert "(bind ?cx-i-name ?i:name) (cx-modify ?i" in rewritten(
        "(modify ?i (name (f ?i:name))) (g ?i:name)"
    )


def test_edits_keep_line_numbers():
    text = (
        "(defrule r =>\n (do-for-all-facts ((?i item))\n TRUE\n (retract ?i)\n (f ?i:name)))\n(defrule s =>)"
    )
    assert prepare_source(text).constructs[1].line == 6


@pytest.mark.parametrize(
    "text", ["(do-for-fact", "(do-for-fact x (retract ?i) ?i:n)", "(do-for-fact ((?i item)) (retract ?i):)"]
)
def test_text_without_query_stays(text):
    assert find_retracted_slot_edits(text, 0, len(text)) == []


def test_right_hand_side_continues_after_retraction(env, log, tmp_path):
    file = tmp_path / "agent.clp"
    file.write_text(
        TEMPLATE + "(defrule clean (go) => (do-for-all-facts ((?i item)) TRUE (retract ?i)"
        ' (printout t "gone " ?i:name " " ?i:tags crlf)) (assert (done)))'
    )
    assert env.load(file)
    env.eval("(reset)")
    env.run()
    assert env.eval("(any-factp ((?d done)) TRUE)")
    assert "gone a (1 2)" in log.texts()
