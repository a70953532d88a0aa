"""Equivalent spellings in PDDL, and names of unsupported parts."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import load_domain, parse_domain, parse_formula, parse_problem
from cxbridge.executive.pddl.ast import Atom, Constant
from cxbridge.executive.pddl.tokens import MAX_WORD_LENGTH

DOMAIN = """\
(define (domain garden)
  (:requirements :strips :typing :fluents)
  (:types pot bed - place seed)
  (:constants corner - bed)
  (:predicates (sown ?s - seed ?p - place) (wet ?p - place))
  (:functions (water) - number (depth ?p - place) - number)
  (:action sow
    :parameters (?s - seed ?p - place)
    :precondition (and (wet ?p) (>= (water) 2) (forall (?o - seed) (or (= ?o ?s) (not (sown ?o ?p)))))
    :effect (and (sown ?s ?p) (decrease (water) 2)))
)
"""
PROBLEM = """\
(define (problem spring)
  (:domain garden)
  (:objects bean - seed big - pot)
  (:init (wet big) (= (water) 5) (= (depth big) 0.3))
  (:goal (and (sown bean big) (not (sown bean corner))))
  (:metric maximize (water))
)
"""
GARDEN = parse_domain(DOMAIN, "garden.pddl")
SPRING = parse_problem(PROBLEM, GARDEN, "spring.pddl")

_LINES = DOMAIN.splitlines(keepends=True)

SAME_DOMAINS = {
    "dashes without blanks": DOMAIN.replace(" - ", " -"),
    "variables without blanks": DOMAIN.replace("(sown ?s ?p)", "(sown ?s?p)"),
    "dashes at variables": DOMAIN.replace("?s - seed ?p - place", "?s -seed?p -place"),
    "keywords in capitals": DOMAIN.replace(":predicates", ":PREDICATES").replace("(and", "(AND"),
    "names in capitals": DOMAIN.replace("(wet ?p) (>=", "(WET ?p) (>=").replace(
        "?s - seed ?p", "?s - SEED ?p"
    ),
    "variables in capitals": DOMAIN.replace("(sown ?s ?p)", "(sown ?S ?P)").replace("(= ?o ?s)", "(= ?O ?s)"),
    "groups without names": DOMAIN.replace("(:constants corner", "(:constants - pot corner"),
    "functions without brackets": DOMAIN.replace("(decrease (water)", "(decrease water").replace(
        "(>= (water)", "(>= water"
    ),
    "no types of functions": DOMAIN.replace(" - number", ""),
    "comments and blanks": DOMAIN.replace("\n", " ; (not closed\n\t").replace("(and", "( and"),
    "a carriage return": DOMAIN.replace("\n", "\r\n"),
    "sections in another order": "".join(
        [*_LINES[:1], *_LINES[5:6], *_LINES[4:5], *_LINES[3:4], *_LINES[2:3], *_LINES[1:2], *_LINES[6:]]
    ),
    "declared without brackets": DOMAIN.replace("(:functions (water) - number", "(:functions water - number"),
}
SAME_PROBLEMS = {
    "sections in capitals": PROBLEM.replace(":init", ":INIT").replace("define", "DEFINE"),
    "the domain's name in capitals": PROBLEM.replace("garden", "GARDEN"),
    "objects in capitals": PROBLEM.replace("(sown bean big)", "(SOWN BEAN Big)"),
    "types in capitals": PROBLEM.replace("big - pot", "big - POT"),
    "a metric in capitals": PROBLEM.replace("maximize", "MAXIMIZE"),
    "a metric without brackets": PROBLEM.replace("maximize (water)", "maximize water"),
    "a value without brackets": PROBLEM.replace("(= (water) 5)", "(= water 5)"),
    "objects in groups without names": PROBLEM.replace("(:objects bean", "(:objects - pot bean"),
    "dashes without blanks": PROBLEM.replace(" - ", " -"),
    "requirements in the problem": PROBLEM.replace("(:objects", "(:requirements :strips) (:objects"),
    "the length of plans": PROBLEM.replace("(:metric", "(:length (:serial 3) (:parallel 2)) (:metric"),
    "a fact that is false": PROBLEM.replace("(wet big)", "(wet big) (not (wet corner))"),
    "a fact twice": PROBLEM.replace("(wet big)", "(wet big) (WET big)"),
}


@pytest.mark.parametrize("text", SAME_DOMAINS.values(), ids=SAME_DOMAINS)
def test_equivalent_domains(text: str) -> None:
    assert text != DOMAIN
    assert parse_domain(text) == GARDEN


@pytest.mark.parametrize("text", SAME_PROBLEMS.values(), ids=SAME_PROBLEMS)
def test_equivalent_problems(text: str) -> None:
    assert text != PROBLEM
    assert parse_problem(text, GARDEN) == SPRING


def test_objects_types_and_predicates_may_share_names() -> None:
    text = PROBLEM.replace("big", "pot").replace("pot - pot", "pot - pot wet - seed")
    problem = parse_problem(text, GARDEN)
    assert problem.init == (Atom("wet", (Constant("pot"),)),)


def test_comments_may_hold_any_bytes(tmp_path: Path) -> None:
    file = tmp_path / "garden.pddl"
    file.write_bytes(b"; \xe9t\xe9 \n" + DOMAIN.encode())
    assert load_domain(file) == GARDEN
    file.write_bytes(DOMAIN.encode().replace(b"bed", b"b\xe9d"))
    with pytest.raises(PddlError, match="unexpected 'b\ufffdd'") as caught:
        load_domain(file)
    assert caught.value.line == 3


def test_problem_of_another_domain_is_a_warning() -> None:
    warnings: list[PddlError] = []
    problem = parse_problem(PROBLEM.replace("garden", "yard"), GARDEN, "p.pddl", warn=warnings.append)
    assert problem.init == SPRING.init
    (warning,) = warnings
    assert "to the domain yard, not to garden" in warning.message


def test_untyped_variable_among_types_is_a_warning() -> None:
    warnings: list[PddlError] = []
    parse_domain(DOMAIN.replace("(?o - seed)", "(?o)"), warn=warnings.append)
    assert [warning.line for warning in warnings] == [9]


def test_error_of_unknown_object_suggests_declaration_in_problem() -> None:
    with pytest.raises(PddlError, match="Unknown constant baen") as caught:
        parse_problem(PROBLEM.replace("sown bean big", "sown baen big"), GARDEN, "p.pddl")
    assert (caught.value.file, caught.value.line) == ("p.pddl", 5)
    assert "(:objects ...)" in (caught.value.hint or "")


NOT_SUPPORTED = {
    "derived predicates": ("(:action", "(:derived (wet ?p - place) (sown bean ?p)) (:action"),
    "constraints on plans": ("(:action", "(:constraints (always (wet corner))) (:action"),
    "preferences": ("(and (wet ?p)", "(and (preference p1 (wet ?p))"),
    "probabilistic effects": ("(sown ?s ?p) (d", "(probabilistic 0.5 (sown ?s ?p)) (d"),
    "continuous effects": ("(decrease (water) 2)", "(decrease (water) (* #t 2))"),
    "object fluents": ("(depth ?p - place) - number", "(depth ?p - place) - seed"),
    "task networks": ("(:action", "(:method m :parameters ()) (:action"),
}
NOT_SUPPORTED_IN_PROBLEMS = {
    "timed initial literals": ("(wet big)", "(at 5 (wet big))"),
    "timed initial literals ": ("(wet big)", "(at 5.5 (not (wet big)))"),
    "preferences": ("(sown bean big) (n", "(preference p1 (sown bean big)) (n"),
    "preferences  ": ("maximize (water)", "minimize (is-violated p1)"),
    "constraints on plans": ("(:metric", "(:constraints (always (wet big))) (:metric"),
    "incomplete initial states": ("(wet big)", "(unknown (wet big))"),
}


@pytest.mark.parametrize(("name", "change"), NOT_SUPPORTED.items())
def test_unsupported_parts_of_domains_are_named(name: str, change: tuple[str, str]) -> None:
    old, new = change
    line = DOMAIN[: DOMAIN.index(old)].count("\n") + 1
    with pytest.raises(PddlError, match="not supported") as caught:
        parse_domain(DOMAIN.replace(old, new, 1), "garden.pddl")
    assert name in caught.value.message
    assert (caught.value.file, caught.value.line) == ("garden.pddl", line)


@pytest.mark.parametrize(("name", "change"), NOT_SUPPORTED_IN_PROBLEMS.items())
def test_unsupported_parts_of_problems_are_named(name: str, change: tuple[str, str]) -> None:
    old, new = change
    line = PROBLEM[: PROBLEM.index(old)].count("\n") + 1
    with pytest.raises(PddlError) as caught:
        parse_problem(PROBLEM.replace(old, new, 1), GARDEN, "spring.pddl")
    text = f"{caught.value.message} {caught.value.hint}"
    assert name.strip() in text
    assert "not supported" in text
    assert (caught.value.file, caught.value.line) == ("spring.pddl", line)


def test_predicate_may_have_name_of_unsupported_part() -> None:
    text = DOMAIN.replace("(wet ?p - place))", "(wet ?p - place) (unknown ?p - place))")
    text = text.replace("(and (wet ?p)", "(and (unknown ?p)")
    assert parse_domain(text).predicates[2].name == "unknown"


def test_long_word_is_one_error() -> None:
    with pytest.raises(PddlError, match=f"more than {MAX_WORD_LENGTH} characters") as caught:
        parse_domain(DOMAIN.replace("corner", "c" * 10_000), "garden.pddl")
    assert caught.value.line == 4
    assert parse_formula(f"({'p' * MAX_WORD_LENGTH})")
