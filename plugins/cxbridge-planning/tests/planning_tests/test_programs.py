"""Programs that plan and come in packages: each one that is installed plans."""

from __future__ import annotations

import pytest

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge.executive.planning import PlanningService, PlanRequest
from cxbridge.executive.planning.engines.programs import PROGRAMS
from cxbridge.executive.planning.engines.registry import make_planner

DOMAIN = parse_domain("""(define (domain rooms) (:requirements :strips :typing :action-costs) (:types room)
  (:predicates (at ?r - room) (door ?a ?b - room)) (:functions (total-cost) - number)
  (:action go :parameters (?a ?b - room) :precondition (and (at ?a) (door ?a ?b))
    :effect (and (at ?b) (not (at ?a)) (increase (total-cost) 1))))""")
TASK = """(define (problem x) (:domain rooms) (:objects k1 k2 k3 - room)
  (:init (at k1) (door k1 k2) (door k2 k3) (= (total-cost) 0)) (:goal (at {goal})) {metric})"""


@pytest.mark.parametrize("name", [name for name, program in PROGRAMS.items() if program.package])
@pytest.mark.parametrize("metric", ["", "(:metric minimize (total-cost))"])
def test_a_plan(name, metric):
    if missing := make_planner(name).not_installed:
        pytest.skip(missing)
    problem = parse_problem(TASK.format(goal="k3", metric=metric), DOMAIN)
    with PlanningService() as service:
        result = service.plan(PlanRequest(DOMAIN, problem, name))
    assert [str(step) for step in result.actions] == ["(go k1 k2)", "(go k2 k3)"], result.message
