"""The findings in PDDL texts of the editor."""

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
def test_unsaved_pddl_text_has_findings_of_check(tmp_path, name, text, expected):
    (tmp_path / "quay.pddl").write_text(QUAY)
    session = Session()
    file = session.model.update(str(tmp_path / name), text)
    assert file is not None
    mistakes = find_mistakes(session, file)
    assert [
        (mistake.code.name, file.lines.line_at(mistake.start), mistake.code.severity.value)
        for mistake in mistakes
    ] == expected


def test_domain_is_case_sensitive_in_agent_that_reads_as_fawkes(tmp_path):
    text = QUAY.replace("(and (free) (not (free)))", "(Free)")
    session = Session()
    file = session.model.update(str(tmp_path / "quay.pddl"), text)
    assert file is not None
    assert [mistake.code.name for mistake in find_mistakes(session, file)] == []
    session.knowledge = AgentKnowledge(reads_as_fawkes=True)
    assert [mistake.code.name for mistake in find_mistakes(session, file)] == ["CX301"]
