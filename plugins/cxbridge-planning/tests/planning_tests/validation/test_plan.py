"""The validation of plans: the first failed step and its false condition."""

from __future__ import annotations

import pytest

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.validation.plan import PlanCheck, check_plan

CUPS = parse_domain("""(define (domain cups) (:requirements :adl :fluents) (:types cup place)
  (:predicates (at ?c - cup ?p - place) (dirty ?c - cup) (open ?p - place))
  (:functions (moved) (most))
  (:action carry :parameters (?c - cup ?a ?b - place)
    :precondition (and (at ?c ?a) (not (= ?a ?b)) (< (moved) (most))
      (forall (?other - cup) (imply (at ?other ?b) (not (dirty ?other)))))
    :effect (and (at ?c ?b) (not (at ?c ?a)) (increase (moved) 1)
      (forall (?p - place) (when (= ?p ?b) (not (open ?p)))) (when (open ?b) (dirty ?c)))))""")
MORNING = """(define (problem p) (:domain cups) (:objects c d - cup table shelf - place)
  (:init (at c table) (at d table) (open shelf) (= (moved) 0) (= (most) {most}))
  (:goal {goal}))"""


def make_steps(*texts):
    return [PlannedAction(name, tuple(rest)) for name, *rest in map(str.split, texts)]


def check(plan, goal="(at c shelf)", most=9):
    problem = parse_problem(MORNING.format(goal=goal, most=most), CUPS)
    return check_plan(CUPS, problem, make_steps(*plan))


def test_valid_plan_reaches_goal():
    goal = "(and (at c shelf) (not (at c table)) (dirty c) (at d table) (not (open shelf)) (= (moved) 1))"
    assert check(["carry c table shelf"], goal) == PlanCheck()


@pytest.mark.parametrize(
    ("plan", "step", "failure"),
    [
        ([], 0, "the goal is not reached: (at c shelf) is false"),
        (["carry c shelf table"], 1, "step 1, (carry c shelf table): (at c shelf) is false"),
        (["carry c table table"], 1, "(= table table) is true"),
        (
            ["carry c table shelf", "carry d table shelf"],
            2,
            "step 2, (carry d table shelf): (dirty c) is true",
        ),
        (["wash c"], 1, "there is no such action"),
        (["carry c table"], 1, "carry takes 3 objects, not 2"),
        (["carry table c shelf"], 1, "?c must be of type cup, which table is not"),
        (["carry e table shelf"], 1, "?c must be of type cup, which e is not"),
    ],
)
def test_first_failed_step_is_reported_with_false_condition(plan, step, failure):
    check_result = check(plan)
    assert check_result.step == step
    assert failure in check_result.failure


def test_false_comparison_is_reported_with_values():
    check_result = check(["carry c table shelf"], most=0)
    assert check_result.failure.endswith("(< (moved) (most)) is false: (moved) is 0, (most) is 0")


def test_goals_with_quantifiers_are_checked():
    assert (
        check(["carry c table shelf"], goal="(and (exists (?c - cup) (at ?c table)) (> (moved) 0))")
        == PlanCheck()
    )
    assert (
        "(dirty c) is true"
        in check(["carry c table shelf"], goal="(forall (?c - cup) (not (dirty ?c)))").failure
    )


KITCHEN = parse_domain("""(define (domain kitchen) (:requirements :durative-actions :fluents :typing)
  (:types cook dish) (:predicates (free ?c - cook) (raw ?d - dish) (done ?d - dish) (lit))
  (:functions (time-of ?d - dish) (cooked))
  (:durative-action cook :parameters (?c - cook ?d - dish)
    :duration (= ?duration (time-of ?d))
    :condition (and (at start (free ?c)) (at start (raw ?d)) (over all (lit)))
    :effect (and (at start (not (free ?c))) (at end (free ?c)) (at start (not (raw ?d))) (at end (done ?d))
      (at end (increase (cooked) 1))))
  (:durative-action blow-out :parameters () :duration (and (>= ?duration 1) (<= ?duration 2))
    :condition (at start (lit)) :effect (at end (not (lit)))))""")
BREAKFAST = parse_problem(
    """(define (problem b) (:domain kitchen) (:objects ann ben - cook egg toast - dish)
  (:init (free ann) (free ben) (raw egg) (raw toast) (lit)
  (= (time-of egg) 4) (= (time-of toast) 2) (= (cooked) 0))
  (:goal (and (done egg) (done toast) (= (cooked) 2))))""",
    KITCHEN,
)


def cook(start, name, dish, duration):
    return PlannedAction("cook", (name, dish), start, duration)


def blow_out(start, duration=1.0):
    return PlannedAction("blow-out", (), start, duration)


@pytest.mark.parametrize(
    ("plan", "failure"),
    [
        ([cook(0, "ann", "egg", 4), cook(0, "ben", "toast", 2)], ""),
        ([cook(0, "ann", "egg", 4), cook(2, "ben", "toast", 2)], ""),
        ([cook(0, "ann", "egg", 4), cook(4.001, "ann", "toast", 2)], ""),
        ([cook(0, "ann", "egg", 4), cook(4, "ann", "toast", 2)], "(free ann) is false"),
        ([cook(0, "ann", "egg", 4), cook(3, "ann", "toast", 2)], "(free ann) is false"),
        ([cook(0, "ann", "egg", 4.0006), cook(0, "ben", "toast", 1.9996)], ""),
        ([cook(0, "ann", "egg", 4.0006), cook(0, "ben", "toast", 1.99)], "it takes 1.99 s"),
        ([cook(0, "ann", "egg", 3), cook(0, "ben", "toast", 2)], "it takes 3 s, but the domain requires 4"),
        (
            [cook(0, "ann", "egg", 4), cook(0, "ben", "toast", 2), blow_out(1)],
            "(cook ann egg): (lit) is false",
        ),
        ([cook(0, "ann", "egg", 4), cook(0, "ben", "toast", 2), blow_out(5)], ""),
        ([cook(0, "ann", "egg", 4), cook(0, "ben", "toast", 2), blow_out(3)], ""),
        ([cook(0, "ann", "egg", 4), cook(0, "ben", "toast", 2), blow_out(5, 3)], "it takes 3 s"),
        ([cook(0, "ann", "egg", 4), cook(0, "ben", "egg", 4)], "both affect (raw egg)"),
        ([cook(0, "ann", "egg", 4)], "the goal is not reached: (done toast) is false"),
        ([cook(None, "ann", "egg", 4), cook(None, "ann", "toast", 2)], ""),
    ],
)
def test_temporal_plans_are_checked(plan, failure):
    check_result = check_plan(KITCHEN, BREAKFAST, plan)
    assert check_result.inconclusive_reason == ""
    assert failure in check_result.failure if failure else not check_result.failure


@pytest.mark.parametrize(
    ("action", "running_action", "failure"),
    [
        (cook(0, "ben", "toast", 2), cook(-1, "ann", "egg", 4), ""),
        (
            cook(0, "ann", "toast", 2),
            cook(-1, "ann", "egg", 4),
            "step 1, (cook ann toast): (free ann) is false",
        ),
        (
            cook(0, "ben", "toast", 2),
            cook(-1, "eve", "egg", 4),
            "(cook eve egg), running: ?c must be of type cook, which eve is not",
        ),
    ],
)
def test_running_actions_count_with_their_start_effects(action, running_action, failure):
    check_result = check_plan(KITCHEN, BREAKFAST, [action], running=[running_action])
    assert check_result.failure == failure


def test_function_without_value_leaves_plan_unchecked():
    text = """(define (problem b) (:domain cups) (:objects c - cup a b - place) (:init (at c a) (= (most) 3))
      (:goal (at c b)))"""
    domain = parse_domain(
        """(define (domain cups) (:requirements :adl :fluents) (:types cup place)
      (:predicates (at ?c - cup ?p - place)) (:functions (moved) (most))
      (:action carry :parameters (?c - cup ?a ?b - place) :precondition (at ?c ?a)
        :effect (and (at ?c ?b) (increase (moved) 1))))"""
    )
    check_result = check_plan(domain, parse_problem(text, domain), make_steps("carry c a b"))
    assert check_result.inconclusive_reason == "(moved) has no value"
    assert not check_result.failure
