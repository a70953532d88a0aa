"""PDDL problems."""

from __future__ import annotations

import pytest

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import (
    PddlSemanticError,
    PddlSyntaxError,
    format_problem,
    load_domain,
    load_problem,
    parse_domain,
    parse_formula,
    parse_problem,
    problem_of_facts,
)
from cxbridge.executive.pddl.ast import FunctionTerm
from tests.support import SHARED, needs_shared

DOMAIN = parse_domain("""(define (domain d) (:requirements :typing) (:types cup - thing place)
  (:constants home - place) (:predicates (at ?t - thing ?p - place)) (:functions (far ?a ?b - place)))""")

TEXT = """(define (problem x) (:domain d)
  (:objects c1 c2 - cup shelf - place)
  (:init (at c1 home) (at c1 home) (= (far home shelf) 2.5)) ; twice, once is enough
  (:goal (and (at c1 shelf) (not (at c2 home))))
  (:metric minimize (total-time)))
"""


def test_problem_is_parsed():
    problem = parse_problem(TEXT, DOMAIN, "x.pddl")
    assert (problem.name, problem.domain, problem.file) == ("x", "d", "x.pddl")
    assert [group.names for group in problem.objects] == [("c1", "c2"), ("shelf",)]
    assert len(problem.init) == 1
    assert [value for _, value in problem.numbers] == [2.5]
    assert problem.metric == ("minimize", FunctionTerm("total-time", ()))


@pytest.mark.parametrize(
    ("old", "new", "error", "message"),
    [
        ("(:domain d)", "", PddlSyntaxError, "there is no (:domain ...)"),
        ("(:goal", "(:gaol", PddlSyntaxError, "unexpected ':gaol'"),
        ("shelf - place", "shelf - plaice", PddlSemanticError, "Unknown type: shelf - plaice"),
        ("(at c1 home) (at", "(at home c1) (at", PddlSemanticError, "Type missmatch"),
        ("(at c1 home) (at", "(at ?x home) (at", PddlSyntaxError, "?x is not an object"),
        ("(at c1 home) (at", "(not (= c1 home)) (at", PddlSyntaxError, "unexpected '='"),
        ("(= (far home shelf) 2.5)", "(= 1 2.5)", PddlSyntaxError, "a fact is expected"),
        ("2.5", "many", PddlSyntaxError, "'many' is not a number"),
        ("(far home shelf)", "(near home shelf)", PddlSemanticError, "Unknown function: near"),
        ("(:metric", "(:goal () ) (:metric", PddlSyntaxError, "the problem has :goal twice"),
        ("(define (problem x)", "(define (domain x)", PddlSyntaxError, "not a problem, but a domain"),
    ],
)
def test_errors_have_file_and_line(old, new, error, message):
    with pytest.raises(error) as caught:
        parse_problem(TEXT.replace(old, new, 1), DOMAIN, "x.pddl")
    assert message in caught.value.message
    assert caught.value.file == "x.pddl"


def test_problem_of_facts():
    problem = problem_of_facts(
        DOMAIN,
        [("c1", "cup"), ("home", "place"), ("c1", "cup")],
        [("at", ("c1", "home")), ("at", ("c1", "home"))],
        parse_formula("(at c1 home)"),
    )
    assert format_problem(problem) == (
        "(define (problem problem)\n  (:domain d)\n  (:objects\n    c1 - cup\n  )\n"
        "  (:init\n    (at c1 home)\n  )\n  (:goal (at c1 home))\n)\n"
    )


def test_durative_actions_minimise_time():
    domain = parse_domain("""(define (domain t) (:predicates (p)) (:durative-action a :parameters ()
      :duration (= ?duration 1) :condition () :effect (at end (p))))""")
    problem = problem_of_facts(domain, [], [], parse_formula("(p)"))
    assert "(:metric minimize (total-time))" in format_problem(problem)


def test_problem_of_invalid_facts_is_an_error():
    with pytest.raises(PddlSemanticError, match="Unknown constant c9") as caught:
        problem_of_facts(DOMAIN, [], [("at", ("c9", "home"))], parse_formula("()"))
    assert "(:objects ...)" in (caught.value.hint or "")


@needs_shared
def test_problem_of_fawkes():
    folder = SHARED / "fawkes-data/pddl/visit-all"
    domain = parse_domain((folder / "domain.pddl").read_text())
    problem = load_problem(folder / "problem.pddl", domain)
    assert parse_problem(format_problem(problem), domain) == problem


def test_swapped_files_and_misspelt_words_have_hint(tmp_path):
    domain, problem = tmp_path / "domain.pddl", tmp_path / "problem.pddl"
    text = "(define (domain d) (:types book) (:predicates (a ?x - book)){})"
    domain.write_text(text.format(" (:action g :parameters (?x - book) :effect (a ?x))"))
    problem.write_text("(define (problem p) (:domain d) (:objects x - bok) (:init) (:goal (a x)))")
    for call, hint in (
        (lambda: load_domain(problem), "are the files in the other order?"),
        (lambda: load_problem(problem, load_domain(domain)), "did you mean book?"),
        (lambda: load_domain(tmp_path / "domian.pddl"), "did you mean domain.pddl?"),
        (lambda: parse_domain(text.format(" (:action g :precondtion (a b))")), "did you mean :precondition?"),
        (lambda: parse_domain(text.format(" (:actoin g)")), "did you mean :action?"),
        (lambda: parse_domain("(defin (domain d))"), "did you mean define?"),
        (lambda: parse_domain("(set (domain d))"), "expected: define"),
    ):
        with pytest.raises(PddlError) as caught:
            call()
        assert caught.value.hint == hint
