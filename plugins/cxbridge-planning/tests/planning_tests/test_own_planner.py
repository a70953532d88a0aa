"""The plug-in with a planner of docs/planning.md."""

from __future__ import annotations

import pytest

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge_planning import PlanningService, PlanRequest
from cxbridge_planning.registry import choose_planners
from tests.plugins import example, forget, install


@pytest.fixture(autouse=True)
def polite(tmp_path, monkeypatch):
    install(tmp_path, monkeypatch, "polite", example("planning.md", "polite"))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))  # of the planner's process
    yield
    forget("polite")


def test_the_planner_plans_and_its_plans_are_checked():
    domain = parse_domain(
        "(define (domain d) (:predicates (met ?x)) (:action greet :parameters (?x) :effect (met ?x)))"
    )
    problem = parse_problem("(define (problem p) (:domain d) (:objects ann bo) (:goal (met bo)))", domain)
    with PlanningService() as service:
        found = service.plan(PlanRequest(domain, problem, "polite"))
        wrong = service.plan(PlanRequest(domain, problem, "polite", {"action": "bow"}))
    assert [str(step) for step in found.actions] == ["(greet ann)", "(greet bo)"], found.message
    assert "step 1, (bow ann): there is no such action" in wrong.message
    assert choose_planners("auto", domain, problem).planners[-1].name == "polite"
