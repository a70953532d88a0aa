"""``check --portable`` finds constructs that CLIPS 6.30 refuses."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from cxbridge.run import RunOptions
from cxbridge_studio.check.run import check
from studio_tests.check.test_check import write_agent
from tests.executive.clips630.engines import PROGRAM, needs_clips630
from tests.support import FAWKES_DIR, share

TEMPLATE = "(deftemplate thing (slot a) (slot b))\n"
ERROR = re.compile(r"\[[A-Z]+\d+\](?! WARNING)")


def list_portable_codes(options: RunOptions) -> list[str]:
    """Return the codes of findings about portability."""
    codes = (finding.code.name for finding in check(options, portable=True))
    return [code for code in codes if code.startswith("CX6")]


def clips630_refuses(file: Path) -> bool:
    """Whether CLIPS 6.30 refuses a construct of a file."""
    commands = f'(load "{file}")\n(exit)\n'
    assert PROGRAM is not None
    output = subprocess.run([PROGRAM], input=commands, capture_output=True, text=True, check=True).stdout
    return ERROR.search(output) is not None


@needs_clips630
@pytest.mark.parametrize(
    ("clips", "code"),
    share(
        [
            ("(defrule r ?t <- (thing) => (modify ?t (b 2)))", ""),
            ("(defrule r ?t <- (thing) => (modify (nth$ 1 (create$ ?t)) (b 2)))", "CX601"),
            ("(deffunction last () 1)(defrule r (thing) => (modify (last) (b 2)))", "CX601"),
            ("(defrule r ?t <- (thing) => (duplicate (assert (thing)) (b 2)))", "CX601"),
            ("(defrule r (thing) => (modify 1 (b 2)))", "CX601"),
            ("(defrule r (thing (a ?x)) => (printout t (max ?x)))", "CX601"),
            ("(defrule r (thing (a ?x)) => (printout t (min ?x 2)))", ""),
            ("(defrule r ?t <- (thing) => (retract (nth$ 1 (create$ ?t))))", ""),
            ('(defrule r (thing) => (printout t "a" crlf))', ""),
            ('(defrule r (thing) => (println "a"))', "CX602"),
            ("(defrule r (thing) => (bind ?x (union$ (create$ a) (create$ b))))", "CX602"),
            ("(deffunction println ($?x) ?x)(defrule r (thing) => (println a))", ""),
            ("(deffunction nth (?x) ?x)(defrule r (thing) => (nth 1))", "CX603"),
            ("(deffunction second (?x) (nth$ 2 ?x))(defrule r (thing (a ?x)) => (second (create$ ?x)))", ""),
        ],
        5,
    ),
)
def test_constructs_refused_by_clips_6_30_are_found(tmp_path, clips, code):
    file = tmp_path / "alone.clp"
    file.write_text(TEMPLATE + clips)
    assert clips630_refuses(file) is bool(code)
    folder = write_agent(tmp_path, clips)
    assert list_portable_codes(RunOptions(scenario=folder)) == ([code] if code else [])
    assert not [
        finding for finding in check(RunOptions(scenario=folder)) if finding.code.name.startswith("CX6")
    ]


@pytest.mark.parametrize(
    ("domain", "code"),
    [
        ("(:requirements :strips) (:predicates (met ?w))", ""),
        ("(:predicates (met ?w)) (:constants me)", "CX608"),
        ("(:requirements :strips) (:predicates (met ?w)) (:functions (n))", ""),
    ],
)
def test_domain_refused_by_fawkes_is_found(tmp_path, domain, code):
    action = "(:action greet :parameters (?who) :precondition (met ?who) :effect (met ?who))"
    folder = write_agent(tmp_path, domain_pddl=f"(define (domain d) {domain} {action})\n")
    assert list_portable_codes(RunOptions(scenario=folder)) == ([code] if code else [])


@pytest.mark.skipif(FAWKES_DIR is None, reason="FAWKES_DIR is not set")
@pytest.mark.parametrize("spec", ["test", "test-pddl"])
def test_agents_of_recordings_have_no_findings(spec):
    assert list_portable_codes(RunOptions(fawkes_dir=FAWKES_DIR, spec=spec)) == []
