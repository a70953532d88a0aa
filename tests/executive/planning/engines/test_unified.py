"""The engines of unified-planning (extra `planners`)."""

from __future__ import annotations

import pytest

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge.executive.planning import PlanningError
from cxbridge.executive.planning.engines.unified import ENGINES, UnifiedPlanner
from tests.executive.planning.compile.test_grounding import FETCH, START, problem
from tests.executive.planning.interpreter import World

INSTALLED = [name for name in ENGINES if not UnifiedPlanner(name).not_installed]
pytestmark = [
    pytest.mark.skipif(not INSTALLED, reason="pip install '.[planners]'"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),  # unified-planning's own
]

STRIPS = """(define (domain Rooms) (:requirements :strips :typing) (:types Room)
  (:predicates (At ?r - Room) (Door ?a ?b - Room))
  (:action Go :parameters (?a ?b - Room) :precondition (and (At ?a) (Door ?a ?b))
    :effect (and (At ?b) (not (At ?a)))))"""
ROOMS = """(define (problem x) (:domain Rooms) (:objects K1 k2 k3 - Room)
  (:init (At K1) (Door K1 k2) (Door k2 k3)) (:goal (At k3)))"""

TEMPORAL = """(define (domain t) (:requirements :durative-actions) (:predicates (ready) (done) (idle))
  (:durative-action prepare :parameters () :duration (= ?duration 2) :condition (at start (idle))
    :effect (and (at start (not (idle))) (at end (ready)) (at end (idle))))
  (:durative-action work :parameters () :duration (= ?duration 3)
    :condition (and (at start (ready)) (at start (idle)))
    :effect (and (at start (not (idle))) (at end (done)) (at end (idle)))))"""


@pytest.mark.parametrize("name", INSTALLED)
def test_names_keep_their_case(name):
    domain = parse_domain(STRIPS)
    plan = UnifiedPlanner(name).solve(domain, parse_problem(ROOMS, domain))
    assert plan
    assert [str(step) for step in plan] == ["(Go K1 k2)", "(Go k2 k3)"]


@pytest.mark.skipif("fast-downward" not in INSTALLED, reason="pip install up-fast-downward")
def test_fast_downward_understands_what_pyperplan_does():
    domain = parse_domain(FETCH)
    task = parse_problem(problem("(and (full c1) (at c1 p) (not (full c2)))", START), domain)
    planner = UnifiedPlanner("fast-downward")
    assert planner.refuses(domain, task) == ""
    assert World(domain, task).is_solution(planner.solve(domain, task))


@pytest.mark.skipif("fast-downward" not in INSTALLED, reason="pip install up-fast-downward")
def test_no_plan():
    domain = parse_domain(STRIPS)
    task = parse_problem(ROOMS.replace("(Door k2 k3)", ""), domain)
    assert UnifiedPlanner("fast-downward").solve(domain, task) is None


@pytest.mark.parametrize("name", [name for name in INSTALLED if name != "fast-downward"])
def test_a_temporal_plan(name):
    domain = parse_domain(TEMPORAL)
    task = parse_problem("(define (problem x) (:domain t) (:init (idle)) (:goal (done)))", domain)
    plan = UnifiedPlanner(name).solve(domain, task)
    assert plan
    (first, first_start, first_duration), (second, start, duration) = [
        (step.name, step.start or 0.0, step.duration) for step in plan
    ]
    assert (first, first_duration, second, duration) == ("prepare", 2.0, "work", 3.0)
    assert start >= first_start + 2.0


def test_the_engine_refuses_a_problem_that_it_cannot_read(monkeypatch):
    domain = parse_domain(STRIPS)
    task = parse_problem(ROOMS, domain)
    monkeypatch.setattr("cxbridge.executive.planning.engines.unified.format_domain", lambda _: "(define")
    with pytest.raises(PlanningError, match="cannot read the problem"):
        UnifiedPlanner(INSTALLED[0]).solve(domain, task)
