"""Doubtful parts of domains."""

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


def find_doubts(text: str, *asserted: str) -> list[tuple[Code, int, str]]:
    return [
        (kind, at.line, message)
        for kind, message, at in doubts.find_domain_doubts(parse_domain(text), asserted)
    ]


def test_sensible_domain_has_no_doubts() -> None:
    assert find_doubts(DOMAIN, "ripe") == []
    assert list(doubts.find_domain_doubts(parse_domain(DOMAIN))) == []


def test_never_true_predicate_and_its_actions_are_doubtful() -> None:
    assert find_doubts(DOMAIN) == [
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
def test_action_that_undoes_its_effect_is_doubtful(old: str, new: str, is_doubtful: bool) -> None:
    text = DOMAIN.replace("(full ?b - basket)", "(full ?b - object)").replace(old, new)
    assert text != DOMAIN
    assert [kind for kind, _, _ in find_doubts(text, "ripe")] == [doubts.UNDONE_EFFECT] * is_doubtful


def test_effect_may_be_undone_at_later_time() -> None:
    timed = """(define (domain d) (:predicates (free)) (:durative-action go :parameters ()
      :duration (= ?duration 2) :effect (and (at start (not (free))) (at end (free)))))"""
    assert find_doubts(timed) == []
    assert [kind for kind, _, _ in find_doubts(timed.replace("at end", "at start"))] == [doubts.UNDONE_EFFECT]


def test_object_without_type_is_doubtful() -> None:
    text = DOMAIN.replace("(:constants old - tree)", "(:constants old - tree young)")
    assert find_doubts(text, "ripe") == [(doubts.UNTYPED_OBJECT, 2, "young has no type: no action takes it")]
    assert find_doubts(text.replace("(?b - basket) :effect", "(?b) :effect"), "ripe") == []


def test_goal_without_achieving_action_is_doubtful() -> None:
    goal = parse_formula("(and (ripe old) (picked old) (or (ripe old)) (not (ripe old)) (unknown))")
    domain = parse_domain(DOMAIN)
    assert [doubt.message for doubt in doubts.find_goal_doubts(domain, goal, ())] == [
        "no action achieves (ripe old)"
    ]
    assert list[Doubt](doubts.find_goal_doubts(domain, goal, {"ripe"})) == []
