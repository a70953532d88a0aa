"""`cxbridge check` on a PDDL file."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.run import RunOptions
from cxbridge_studio.check.run import check

DOMAIN = """(define (domain Quay) (:types ship crane)
  (:predicates (moored ?s - ship) (empty ?s - ship) (idle ?c - crane))
  (:action unload :parameters (?s - ship ?c - crane)
    :precondition (and (moored ?s) (idle ?c)) :effect (empty ?s)))
"""
PROBLEM = """(define (problem p) (:domain quay) (:objects anna - ship c1 - crane)
  (:init (moored anna) (idle c1))
  (:goal (empty anna)))
"""


def check_file(folder: Path, name: str, *, domain: str = DOMAIN, problem: str = PROBLEM) -> list[str]:
    (folder / "quay.pddl").write_text(domain)
    (folder / "p.pddl").write_text(problem)
    findings = check(RunOptions(scenario=folder / name))
    return [
        f"{Path(finding.place.file).name}:{finding.place.line} {finding.code.name}" for finding in findings
    ]


def test_domain_file_is_checked(tmp_path: Path) -> None:
    assert check_file(tmp_path, "quay.pddl") == ["quay.pddl:2 CX310"]
    typed = DOMAIN.replace("(:types", "(:requirements :typing) (:types")
    assert check_file(tmp_path, "quay.pddl", domain=typed) == []
    assert check_file(tmp_path, "quay.pddl", domain=typed.replace("(idle ?c))", "(idel ?c))")) == [
        "quay.pddl:4 CX301"
    ]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("", "", []),
        ("(idle c1)", "", ["quay.pddl:2 CX311", "quay.pddl:3 CX312"]),
        ("(:goal (empty", "(:goal (moored", []),
        ("(:init (moored anna)", "(:init (empty anna)", ["quay.pddl:2 CX311", "quay.pddl:3 CX312"]),
        ("- crane", "", ["p.pddl:2 CX310", "p.pddl:1 CX314"]),
        ("(empty anna)", "(empty ann)", ["p.pddl:3 CX301"]),
        ("quay", "dock", ["p.pddl:0 CX302"]),
    ],
)
def test_problem_is_checked_with_domain_in_its_folder(
    tmp_path: Path, old: str, new: str, expected: list[str]
) -> None:
    findings = check_file(tmp_path, "p.pddl", problem=PROBLEM.replace(old, new) if old else PROBLEM)
    assert findings == expected
