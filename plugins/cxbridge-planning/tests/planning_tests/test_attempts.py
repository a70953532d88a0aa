"""The planner `auto`, which tries planners in turn and names the reasons of failures."""

from __future__ import annotations

import os

import pytest

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge.executive.pddl.ast import FORMULA_CLASSES
from cxbridge_planning import PlanningService, PlanRequest, PlanStatus, UnsupportedProblemError
from cxbridge_planning.engines import unified
from cxbridge_planning.needs import Need, problem_needs
from cxbridge_planning.registry import AUTO, choose_planners, make_planner, planner_names

DOMAIN = parse_domain("""(define (domain t) (:requirements :durative-actions) (:predicates (done))
  (:durative-action work :parameters () :duration (= ?duration 3) :effect (at end (done))))""")
PROBLEM = parse_problem("(define (problem p) (:domain t) (:init) (:goal (done)))", DOMAIN)
PLANS = "printf ';;;; Solution Found\\n0.000: (work) [3.000]\\n'"
INVALID_PLANS = "printf ';;;; Solution Found\\n0.000: (work) [7.000]\\n'"
CRASHES = "echo 'no idea'; exit 9"
HANGS = "exec sleep 1000"


@pytest.fixture
def add_programs(tmp_path, monkeypatch):
    """Return a function that puts two temporal planners on the PATH, as the only installed planners."""

    def add(optic, popf):
        for name, script in (("optic-clp", optic), ("popf", popf)):
            (tmp_path / name).write_text(f"#!/bin/sh\n{script}\n")
            (tmp_path / name).chmod(0o755)
        monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")

    monkeypatch.setattr(unified, "find_spec", lambda _name: None)
    monkeypatch.setattr("cxbridge_planning.engines.programs.find_spec", lambda _name: None)
    return add


@pytest.fixture
def service():
    with PlanningService() as service:
        yield service


@pytest.mark.parametrize(
    ("optic", "reason"),
    [
        (CRASHES, "optic ended with exit status 9 and without a plan: no idea"),
        (
            INVALID_PLANS,
            "optic made an invalid plan: step 1, (work): it takes 7 s, but the domain requires 3",
        ),
        (HANGS, "optic found no plan within 1"),
        ("kill -SEGV $$", "optic ended with exit status -11"),
    ],
)
def test_next_planner_replaces_failed_planner(add_programs, service, optic, reason):
    add_programs(optic, PLANS)
    result = service.plan(PlanRequest(DOMAIN, PROBLEM, timeout=3.0))
    assert (result.status, result.planner) == (PlanStatus.PLANNED, "popf"), result.message
    assert reason in result.why
    assert "pyperplan does not support durative actions (action work)" in result.why


def test_message_has_reasons_of_all_failed_planners(add_programs, service):
    add_programs(CRASHES, INVALID_PLANS)
    result = service.plan(PlanRequest(DOMAIN, PROBLEM, timeout=10.0))
    assert result.status is PlanStatus.FAILED
    assert "no idea" in result.message
    assert "it takes 7 s" in result.message


def test_proof_of_unsolvability_ends_attempts(add_programs, service):
    add_programs("echo unsolvable", CRASHES)
    assert service.plan(PlanRequest(DOMAIN, PROBLEM)).status is PlanStatus.NO_PLAN


def test_timeout_names_tried_and_missing_planners(add_programs, service):
    add_programs(HANGS, HANGS)
    result = service.plan(PlanRequest(DOMAIN, PROBLEM, timeout=0.6))
    assert result.status is PlanStatus.TIMEOUT
    assert result.message.startswith(
        "no plan within 0.6 s (tried: optic, popf): give more time, or install one of"
    )
    assert "aries" in result.message


def test_unsupported_problem_names_all_planners(add_programs, service):
    add_programs(PLANS, PLANS)
    text = "(:predicates (done) (p)) (:action a :parameters () :precondition (not (p)) :effect (p))"
    domain = parse_domain(
        "(define (domain t) (:requirements :durative-actions :adl) "
        f"{text} (:durative-action work :parameters () :duration (= ?duration 3) :effect (at end (done))))"
    )
    with pytest.raises(UnsupportedProblemError) as raised:
        choose_planners(AUTO, domain, PROBLEM)
    for name in planner_names():
        assert name in raised.value.message


COSTS = """(define (domain c) (:requirements :strips :action-costs) (:predicates (a) (b))
  (:functions (total-cost) - number)
  (:action dear :parameters () :effect (and (b) (increase (total-cost) 100)))
  (:action cheap :parameters () :effect (and (a) (increase (total-cost) 1)))
  (:action cheaper :parameters () :precondition (a) :effect (and (b) (increase (total-cost) 1))))"""
TASK = "(define (problem x) (:domain c) (:init (= (total-cost) 0)) (:goal (b)) {metric})"


def choose(metric):
    domain = parse_domain(COSTS)
    return choose_planners(AUTO, domain, parse_problem(TASK.format(metric=metric), domain))


def test_cost_metric_puts_planners_without_costs_last():
    chosen = choose("(:metric minimize (total-cost))")
    ignores_costs = [planner.name in {"pyperplan", "tamer"} for planner in chosen.planners]
    assert ignores_costs == sorted(ignores_costs)
    assert "pyperplan ignores costs of actions" in chosen.reasons


def test_costs_without_metric_are_not_needed():
    assert "pyperplan ignores costs of actions" not in choose("").reasons


@pytest.mark.skipif(bool(make_planner("aries").unavailable_reason), reason="needs aries")
def test_plan_minimises_costs(service):
    domain = parse_domain(COSTS)
    problem = parse_problem(TASK.format(metric="(:metric minimize (total-cost))"), domain)
    result = service.plan(PlanRequest(domain, problem))
    assert [str(step) for step in result.actions] == ["(cheap)", "(cheaper)"], result.why


FRACTIONS = {Need.NUMERIC_CHANGES, Need.NUMBERS, Need.FRACTIONS}


@pytest.mark.parametrize(
    ("effect", "condition", "init", "expected"),
    [
        ("(increase (f) 1)", "(p)", "", {Need.NUMERIC_CHANGES}),
        ("(increase (f) 1)", "(> (f) 1)", "(= (f) 2)", {Need.NUMERIC_CHANGES, Need.NUMBERS}),
        (
            "(increase (f) 1)",
            "(> (f) 1)",
            "(= (f) 2.5)",
            {Need.NUMERIC_CHANGES, Need.NUMBERS, Need.FRACTIONS},
        ),
        ("(increase (f) 0.5)", "(> (f) 1)", "", {Need.NUMERIC_CHANGES, Need.NUMBERS, Need.FRACTIONS}),
        ("(scale-down (f) 2)", "(> (f) 1)", "", {Need.NUMERIC_CHANGES, Need.NUMBERS, Need.FRACTIONS}),
        ("(p)", "(> (/ (f) 3) 1)", "", {Need.NUMBERS, Need.FRACTIONS}),
    ],
)
def test_needs_of_numeric_problems(effect, condition, init, expected):
    domain = parse_domain(
        f"""(define (domain d) (:requirements :fluents) (:predicates (p)) (:functions (f))
      (:action a :parameters () :precondition {condition} :effect {effect}))"""
    )
    problem = parse_problem(f"(define (problem p) (:domain d) (:init {init}) (:goal (p)))", domain)
    assert problem_needs(domain, problem).keys() == expected


def test_features_of_formulas_are_needs():
    assert {node.KIND.feature for node in FORMULA_CLASSES} <= {"", *(need.value for need in Need)}


@pytest.mark.parametrize("name", planner_names())
def test_planner_ignores_only_unsupported_needs(name):
    planner = make_planner(name)
    assert not planner.understands & planner.ignores
    assert all(len(each) > 1 for each in planner.fails_with)
