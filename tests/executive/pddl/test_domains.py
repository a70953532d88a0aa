"""Sections and actions of a domain."""

from __future__ import annotations

import pytest

from cxbridge.executive.pddl import PddlSyntaxError, parse_domain
from cxbridge.executive.pddl.ast import (
    Atom,
    Constant,
    Not,
    TermComparison,
    Timed,
    Variable,
)
from tests.executive.pddl.texts import GARDEN, domain


def test_durative_action() -> None:
    text = """(:durative-action go :parameters (?r - robot) :duration (= ?duration 5)
        :condition (and (at start (ready)) (over all (ready)))
        :conditional-breakup (ready) :temporal-breakup (ready) :effect (at end (not (ready))))"""
    go = parse_domain(domain(text)).actions[0]
    assert go.is_durative
    assert go.duration == TermComparison("=", Variable("duration"), Constant("5"))
    assert go.effect == Timed("at end", Not(Atom("ready", ())))


def test_sections_of_action_may_be_absent_or_swapped() -> None:
    bare, swapped = parse_domain(
        domain("(:action a)\n(:action b :effect (ready) :precondition (ready) :parameters ())")
    ).actions
    assert (bare.condition, bare.effect) == (None, None)
    assert swapped.condition == swapped.effect


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", 1, "unexpected end of the domain"),
        ("word", 1, "unexpected 'word'"),
        ("(define (domain (x)))", 1, r"unexpected '\(' in \(domain ...\)"),
        ("(define (domain x)\n(:foo))", 2, "unexpected ':foo'"),
        ("(define (domain x)\n(:types a) (:types b))", 2, "the domain has :types twice"),
        ("(define (domain x)\n(:types a - ))", 2, r"unexpected '\)' in \(:types ...\)"),
        ("(define (domain x)\n(:functions (f) - object))", 2, "can only be a number"),
        ("(define (domain x)\n(:action a :effects (p)))", 2, "unexpected ':effects'"),
        (
            "(define (domain x)\n(:action a :parameters ()\n:parameters ()))",
            3,
            "action a has :parameters twice",
        ),
        ("(define (domain x))\n(more)", 2, r"unexpected '\('"),
    ],
)
def test_syntax_errors(text: str, line: int, message: str) -> None:
    with pytest.raises(PddlSyntaxError, match=message) as caught:
        parse_domain(text, "d.pddl")
    assert (caught.value.file, caught.value.line) == ("d.pddl", line)
    assert caught.value.column is not None


ONE_ACTION = "(:action a :parameters () :precondition (ready) :effect (ready))"
SWAPPED = "(:action a :parameters () :effect (ready) :precondition (ready))"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (GARDEN.replace("(:requirements :strips :typing)", ""), "there are no requirements"),
        (f"(define (domain x) (:requirements) {ONE_ACTION})", "there are no predicates"),
        ("(define (domain x) (:requirements) (:predicates (p)))", "there are no actions"),
        (GARDEN.replace(":precondition (held ?t)", ""), "action pick has no condition"),
        (GARDEN.replace(":effect (not (held ?t))", ""), "action pick has no effect"),
        (domain(SWAPPED), ":precondition must come earlier"),
        (domain(ONE_ACTION, types="(:constants k)", constants="(:types t)"), ":types must come earlier"),
    ],
)
def test_strict_parser_refuses_domains_as_fawkes_does(text: str, reason: str) -> None:
    with pytest.raises(PddlSyntaxError, match="Fawkes' parser refuses this") as caught:
        parse_domain(text, fawkes_compat=True)
    assert reason in caught.value.message


@pytest.mark.parametrize("rest", ["(:foo bar)", "word", "(:predicates (late))", "(foo) (:action x)"])
def test_strict_parser_ignores_text_after_last_action(rest: str) -> None:
    text = GARDEN.rstrip().removesuffix(")")
    for tail in (")", "", f"{rest})", f"{rest}", f") {rest}"):
        assert parse_domain(text + tail, fawkes_compat=True) == parse_domain(GARDEN)
    with pytest.raises(PddlSyntaxError):
        parse_domain(f"{text} {rest}")
