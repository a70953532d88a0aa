"""Domains that PlanSys2 would refuse: what its parser's source says, line by line."""

from __future__ import annotations

import pytest

from cxbridge_ros2cx.plansys2_domain import REQUIREMENTS, find_domain_error
from ros2cx_tests.test_features import DOMAIN, Bench, know_the_world
from tests.support import ROS2CX_DIR, needs_ros2cx

HEAD = """(define (domain d)
  (:requirements :strips :typing :durative-actions)
  (:types robot)
  (:predicates (at ?r - robot) (free))
"""
MOVE = "(:durative-action a :parameters () :duration (= ?duration 5) :condition {} :effect (at end (free)))"


def reason(tmp_path, text):
    file = tmp_path / "domain.pddl"
    file.write_text(text)
    return find_domain_error(str(file))


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (HEAD.replace(":strips", ":strips :numeric-fluents") + ")", 2, "the requirement :numeric-fluents"),
        (HEAD.replace(":typing", ":adl") + ")", 3, "needs the requirement :typing"),
        ("(define (domain d)\n (:action a :parameters () :effect ()))", 2, "needs predicates before"),
        (HEAD + "(:action a :effect (free)))", 5, "must have :parameters, :effect, in this order"),
        (
            HEAD + "(:action a :parameters () :precondition (free)))",
            5,
            ":precondition, :effect",
        ),
        (HEAD + "(:action a :parameters () :effect (free) :precondition ()))", 5, "in this order"),
        (
            HEAD + "(:action a :parameters ()\n :effect (and (scale-up (f) 2))))",
            6,
            "it does not support 'scale-up'",
        ),
        (
            HEAD + "(:action a :parameters () :precondition (preference p (free)) :effect ()))",
            5,
            "'preference'",
        ),
        (
            HEAD + MOVE.format("()").replace("(= ?duration 5)", "(>= ?duration 5)") + ")",
            5,
            "a duration",
        ),
        (
            HEAD + MOVE.format("()").replace(":duration (= ?duration 5)", "") + ")",
            5,
            ", :duration",
        ),
        (HEAD + MOVE.format("(free)") + ")", 5, "parts of a durative action"),
        (
            HEAD + MOVE.format("(and (at start (free)) (over (free)))") + ")",
            5,
            "parts of a durative action",
        ),
    ],
)
def test_what_it_would_refuse(tmp_path, text, line, message):
    error = reason(tmp_path, text)
    assert message in str(error)
    assert error.line == line


@pytest.mark.parametrize(
    "text",
    [
        HEAD + ")",
        HEAD + "(:action a :parameters (?r - (either robot object)) :precondition () :effect (free)))",
        HEAD + "(:action a :parameters () :precondition (or (free) (free)) :effect (when (free) (free))))",
        HEAD + MOVE.format("()") + ")",
        HEAD + MOVE.format("(at start (free))") + ")",
        HEAD + MOVE.format("(and (at start (free)) (over all (free)) (at end (free)))") + ")",
        HEAD.upper() + ")",
        HEAD.replace(":strips :typing", " ".join(f":{name}" for name in REQUIREMENTS)) + ")",
        "(define (domain d) (:axiom x))",  # it does not look at blocks that it does not know
        "(define (domain d))",
    ],
)
def test_what_it_would_take(tmp_path, text):
    assert reason(tmp_path, text) is None


@needs_ros2cx
def test_the_domains_of_the_thesis_are_fine():
    assert ROS2CX_DIR is not None
    domains = list(ROS2CX_DIR.rglob("domain.pddl"))
    assert len(domains) >= 4
    assert {str(file): find_domain_error(str(file)) for file in domains} == dict.fromkeys(map(str, domains))


@pytest.mark.parametrize("repeats_defects", [False, True])
def test_by_default_there_is_a_warning_and_in_the_mode_original_no_plan(tmp_path, repeats_defects):
    bench = Bench(
        tmp_path,
        DOMAIN.replace(":strips", ":strips :quantified-preconditions"),
        repeats_defects=repeats_defects,
    )
    try:
        for _ in range(2):
            know_the_world(bench.env)
            bench.env.call("psys2-call-planner", "G", "(at r2 work)", "P")
        statuses = [status for status, _ in bench.facts("pddl-plan-feedback", "status", "plan-id")]
        said = [
            line
            for line in bench.log.lines
            if "it does not support the requirement :quantified-preconditions" in line.text
        ]
        assert set(statuses) == {"PLAN-FAILED" if repeats_defects else "PLANNED"}
        assert len(said) == (2 if repeats_defects else 1)
    finally:
        bench.manager.close()
