"""Absurd parts of a domain."""

from __future__ import annotations

import pytest

from cxbridge.executive.pddl import parse_domain, parse_formula
from cxbridge_studio.check import doubts
from cxbridge_studio.check.doubts import Doubt
from cxbridge_studio.check.findings import Code

DOMAIN = """\
(define (domain orchard) (:requirements :adl)
  (:types tree basket) (:constants old - tree)
  (:predicates (ripe ?t - tree) (picked ?t - tree) (open ?b - basket) (full ?b - basket))
  (:action open :parameters (?b - basket) :effect (open ?b))
  (:action pick :parameters (?t - tree ?b - basket)
    :precondition (and (ripe ?t) (open ?b) (not (full ?b)))
    :effect (and (picked ?t) (when (picked old) (not (open ?b))) (full ?b)))
  (:action empty :parameters (?b - basket) :precondition (full ?b) :effect (not (full ?b)))
)
"""


def found(text: str, *made: str) -> list[tuple[Code, int, str]]:
    return [
        (kind, at.line, message) for kind, message, at in doubts.find_domain_doubts(parse_domain(text), made)
    ]


def test_a_domain_that_means_what_it_says() -> None:
    assert found(DOMAIN, "ripe") == []
    assert list(doubts.find_domain_doubts(parse_domain(DOMAIN))) == []


def test_a_predicate_that_nothing_makes_and_the_actions_that_wait_for_it() -> None:
    assert found(DOMAIN) == [
        (
            doubts.FALSE_PREDICATE,
            3,
            "(ripe) is never true: no action has it as an effect, nothing else makes it",
        ),
        (
            doubts.IMPOSSIBLE_ACTION,
            5,
            "the action pick can never be done: nothing makes (ripe) true before it",
        ),
        (
            doubts.IMPOSSIBLE_ACTION,
            8,
            "the action empty can never be done: nothing makes (full) true before it",
        ),
    ]


@pytest.mark.parametrize(
    ("old", "new", "is_doubtful"),
    [
        ("(picked ?t) (when", "(picked ?t) (not (picked ?t)) (when", True),
        ("(picked ?t) (when", "(picked ?t) (forall (?c - tree) (not (picked ?c))) (when", False),
        ("(not (open ?b))", "(and (open ?b) (not (open ?b)))", True),
        ("(not (full ?b)))\n)", "(and (full old) (not (full ?b))))\n)", False),
    ],
)
def test_an_action_that_takes_its_effect_back(old: str, new: str, is_doubtful: bool) -> None:
    text = DOMAIN.replace("(full ?b - basket)", "(full ?b - object)").replace(old, new)
    assert text != DOMAIN
    assert [kind for kind, _, _ in found(text, "ripe")] == [doubts.UNDONE_EFFECT] * is_doubtful


def test_at_different_times_an_effect_may_be_taken_back() -> None:
    timed = """(define (domain d) (:predicates (free)) (:durative-action go :parameters ()
      :duration (= ?duration 2) :effect (and (at start (not (free))) (at end (free)))))"""
    assert found(timed) == []
    assert [kind for kind, _, _ in found(timed.replace("at end", "at start"))] == [doubts.UNDONE_EFFECT]


def test_an_object_of_no_type() -> None:
    text = DOMAIN.replace("(:constants old - tree)", "(:constants old - tree young)")
    assert found(text, "ripe") == [(doubts.UNTYPED_OBJECT, 2, "young has no type: no action takes it")]
    assert found(text.replace("(?b - basket) :effect", "(?b) :effect"), "ripe") == []


def test_goals_that_no_action_achieves() -> None:
    goal = parse_formula("(and (ripe old) (picked old) (or (ripe old)) (not (ripe old)) (unknown))")
    domain = parse_domain(DOMAIN)
    assert [doubt.message for doubt in doubts.find_goal_doubts(domain, goal, ())] == [
        "no action achieves (ripe old)"
    ]
    assert list[Doubt](doubts.find_goal_doubts(domain, goal, {"ripe"})) == []
