"""Findings about slots and values in changes of facts."""

from __future__ import annotations

import pytest

from cxbridge.run import RunOptions
from cxbridge_studio.check.run import check
from studio_tests.check.test_check import write_agent

TEMPLATES = (
    "(deftemplate lamp (slot state (allowed-values ON OFF)) (multislot tags) (slot a))\n(deffacts l (lamp))\n"
)


def check_clips(folder, clips):
    return check(RunOptions(scenario=write_agent(folder, TEMPLATES + clips)))


@pytest.mark.parametrize(
    ("clips", "code", "word"),
    [
        ("(defrule r ?l <- (lamp) => (modify ?l (sate ON)))", "CX210", "state"),
        ("(defrule r ?l <- (lamp) => (duplicate ?l (sate ON)))", "CX210", "state"),
        ("(defrule r ?l <- (lamp) => (if TRUE then (modify ?l (sate ON))))", "CX210", "state"),
        (
            "(defrule r (exists (lamp)) => (do-for-fact ((?l lamp)) TRUE (modify ?l (sate ON))))",
            "CX210",
            "state",
        ),
        ("(defrule r (lamp) => (do-for-all-facts ((?l lamp)) ?l:sate (retract ?l)))", "CX210", "state"),
        (
            "(defrule r (lamp) => (delayed-do-for-all-facts ((?l lamp)) TRUE (modify ?l (sate ON))))",
            "CX210",
            "st",
        ),
        ("(defrule r (lamp) => (any-factp ((?l lamp)) (eq ?l:sate ON)))", "CX210", "state"),
        ("(defrule r (lamp) => (bind ?l (assert (lamp))) (modify ?l (sate ON)))", "CX210", "state"),
        (
            "(defrule r ?l <- (lamp) => (bind ?l (modify ?l (state ON))) (modify ?l (sate ON)))",
            "CX210",
            "state",
        ),
        (
            "(deffunction f () (do-for-fact ((?l lamp)) TRUE (modify ?l (sate ON))))(defrule r => (f))",
            "CX210",
            "",
        ),
        ("(defrule r ?l <- (lamp) => (modify ?l (state ONN)))", "CX211", "did you mean ON"),
        ("(defrule r ?g <- (goal (class X)) => (modify ?g (mod FINISHED)))", "CX210", "did you mean mode"),
        ("(defrule r ?g <- (goal (class X)) => (modify ?g (mode FINISHD)))", "CX211", "FINISHED"),
        ("(defrule r ?g <- (goal (class X)) => (modify ?g (mode FINISHED) (outcome DONE)))", "CX211", "DONE"),
        ("(defrule r ?p <- (plan-action (id 1)) => (modify ?p (state PENDNG)))", "CX211", "PENDING"),
        # the query shadows ?l; after the query, ?l is the lamp
        (
            "(defrule r ?l <- (lamp) => (do-for-fact ((?l thing)) TRUE (modify ?l (a 1))) (modify ?l (b 1)))",
            "CX210",
            "'lamp' has no slot 'b'",
        ),
    ],
)
def test_impossible_slot_or_value_is_found(tmp_path, clips, code, word):
    findings = [
        finding for finding in check_clips(tmp_path, clips) if finding.code.name in ("CX210", "CX211")
    ]
    assert [finding.code.name for finding in findings] == [code]
    assert word in f"{findings[0].message} {findings[0].hint}"
    assert findings[0].place.line == 4


@pytest.mark.parametrize(
    "clips",
    [
        "(defrule r ?l <- (lamp) => (modify ?l (state OFF) (tags A B) (a 1)))",
        "(defrule r ?l <- (lamp (state ?s)) => (modify ?l (state ?s)))",
        "(defrule r ?l <- (lamp) => (modify ?l (state (sym-cat O N))))",
        "(defrule r (or ?l <- (lamp) ?l <- (thing)) => (modify ?l (b 1)))",
        "(defrule r ?l <- (lamp) => (bind ?l (nth$ 1 (find-fact ((?t thing)) TRUE))) (modify ?l (b 1)))",
        "(defrule r ?l <- (lamp) => (foreach ?l (find-all-facts ((?t thing)) TRUE) (modify ?l (b 1))))",
        "(defrule r ?l <- (lamp) => (progn$ (?l (find-all-facts ((?t thing)) TRUE)) (modify ?l (b 1))))",
        "(defrule r (lamp) => (do-for-fact ((?l lamp thing)) TRUE (modify ?l (b 1))))",
        "(defrule r (lamp) => (do-for-fact ((?l lamp) (?t thing)) TRUE (modify ?t (b 1)) (modify ?l (a 1))))",
        "(deffunction f (?l) (modify ?l (nothing 1)))(defrule r ?l <- (lamp) => (f ?l))",
        "(defrule r (lamp) => (bind ?l (assert (thing))) (bind ?l (assert (lamp))) (modify ?l (b 1)))",
        "(defrule r ?l <- (lamp) => (do-for-fact ((?l thing)) TRUE (modify ?l (b 1))))",
        "(defrule r ?x <- (word 1) => (modify ?x (b 1)))",
    ],
)
def test_possible_slot_or_value_has_no_finding(tmp_path, clips):
    assert [
        finding for finding in check_clips(tmp_path, clips) if finding.code.name in ("CX210", "CX211")
    ] == []
