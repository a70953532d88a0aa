"""The parts of a goal that no relaxed plan reaches."""

from __future__ import annotations

import pytest

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge_planning.compile.relaxed import unreachable_goal_lines

DOMAIN = parse_domain("""(define (domain cups) (:requirements :adl :durative-actions :fluents)
  (:types cup place) (:predicates (at ?c - cup ?p - place) (way ?a ?b - place) (red ?c - cup) (lit)
    (polished ?c - cup) (bright ?c - cup))
  (:functions (moved))
  (:action carry :parameters (?c - cup ?a ?b - place) :precondition (and (at ?c ?a) (way ?a ?b))
    :effect (and (at ?c ?b) (not (at ?c ?a)) (increase (moved) 1)))
  (:durative-action shine :parameters (?c - cup) :duration (= ?duration 1)
    :condition (over all (polished ?c)) :effect (at end (bright ?c)))
  (:durative-action light :parameters () :duration (= ?duration 1) :condition (over all (lit))
    :effect (and (at start (lit)) (at end (not (lit))))))""")
TASK = """(define (problem p) (:domain cups) (:objects c d - cup kitchen table tabel - place)
  (:init (at c kitchen) (red d) (way kitchen table) (= (moved) 0)) (:goal {goal}))"""


@pytest.mark.parametrize(
    ("goal", "reasons"),
    [
        ("(at c table)", []),
        ("(lit)", []),
        ("(and (at c table) (not (at c kitchen)) (> (moved) 7))", []),
        ("(imply (> (moved) 7) (red c))", []),
        ("(not (or (> (moved) 7) (at c kitchen)))", []),
        ("(not (or (not (> (moved) 7)) (at c kitchen)))", []),
        ("(at c tabel)", ["nothing achieves (at c tabel)"]),
        (
            "(and (at c tabel) (red c))",
            [
                "nothing achieves (at c tabel)",
                "nothing achieves (red c): no action changes red",
            ],
        ),
        ("(bright c)", ["nothing achieves (bright c)"]),
        ("(not (red d))", []),
        (
            "(or (and (red c) (at c tabel)) (at d tabel))",
            ["nothing achieves (at d tabel)"],
        ),
        ("(exists (?p - place) (and (at d ?p) (way ?p tabel)))", None),
    ],
)
def test_unreachable_parts_of_goal_are_named(goal, reasons):
    lines = unreachable_goal_lines(DOMAIN, parse_problem(TASK.format(goal=goal), DOMAIN))
    assert lines == reasons if reasons is not None else lines
