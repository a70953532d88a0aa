"""The plug-in with a planner in docs/planning.md."""

from __future__ import annotations

import pytest

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge_planning import PlanningService, PlanRequest
from cxbridge_planning.registry import choose_planners
from tests.plugins import example, forget, install


@pytest.fixture(autouse=True)
def plugin(tmp_path, monkeypatch):
    install(tmp_path, monkeypatch, "polite", example("planning.md", "polite"))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))  # for the process of the planner
    yield
    forget("polite")


def test_planner_of_manual_plans_and_is_checked():
    domain = parse_domain(
        "(define (domain d) (:predicates (met ?x)) (:action greet :parameters (?x) :effect (met ?x)))"
    )
    problem = parse_problem("(define (problem p) (:domain d) (:objects ann bo) (:goal (met bo)))", domain)
    with PlanningService() as service:
        result = service.plan(PlanRequest(domain, problem, "polite"))
        refused = service.plan(PlanRequest(domain, problem, "polite", {"action": "bow"}))
    assert [str(step) for step in result.actions] == ["(greet ann)", "(greet bo)"], result.message
    assert "step 1, (bow ann): there is no such action" in refused.message
    assert choose_planners("auto", domain, problem).planners[-1].name == "polite"
