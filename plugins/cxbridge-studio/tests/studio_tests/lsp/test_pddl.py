"""PDDL in the editor: the findings of the check, while a user types."""

from __future__ import annotations

import pytest

from cxbridge_studio.lsp.diagnostics import find_mistakes
from cxbridge_studio.lsp.knowledge import AgentKnowledge
from cxbridge_studio.lsp.session import Session

QUAY = """(define (domain quay) (:requirements :strips :typing) (:types ship)
  (:predicates (moored ?s - ship) (sunk ?s - ship) (free))
  (:action go :parameters (?s - ship) :precondition (moored ?s) :effect (and (free) (not (free)))))
"""
HARBOUR = """(define (problem p) (:domain quay) (:objects anna - ship bo)
  (:init (moored anna)) (:goal (sunk bo)))"""


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("quay.pddl", QUAY, [("CX313", 3, "warning")]),
        ("quay.pddl", QUAY.replace(":typing", ""), [("CX310", 2, "warning"), ("CX313", 3, "warning")]),
        ("quay.pddl", QUAY.replace("(free) (not", "(fere) (not"), [("CX301", 3, "error")]),
        ("p.pddl", HARBOUR, [("CX310", 2, "warning"), ("CX314", 1, "warning"), ("CX315", 2, "warning")]),
    ],
)
def test_doubts_about_pddl_are_live(tmp_path, name, text, expected):
    """The findings of the check in a domain, and in a problem with its domain."""
    (tmp_path / "quay.pddl").write_text(QUAY)
    session = Session()
    file = session.model.update(str(tmp_path / name), text)
    assert file is not None
    found = find_mistakes(session, file)
    assert [
        (each.code.name, file.lines.at(each.start), each.code.severity.value) for each in found
    ] == expected


def test_a_domain_of_an_agent_that_reads_as_fawkes(tmp_path):
    text = QUAY.replace("(and (free) (not (free)))", "(Free)")
    session = Session()
    file = session.model.update(str(tmp_path / "quay.pddl"), text)
    assert file is not None
    assert [each.code.name for each in find_mistakes(session, file)] == []
    session.knowledge = AgentKnowledge(reads_as_fawkes=True)
    assert [each.code.name for each in find_mistakes(session, file)] == ["CX301"]
