"""Large or odd texts are read in little time, or are one error with its line."""

from __future__ import annotations

import time
from contextlib import suppress

import pytest

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import parse_domain, parse_problem
from tests.support import share

MANY = 20_000

LARGE = {
    "a chain of types": f"(:types {' '.join(f't{n} - t{n + 1}' for n in range(MANY))})",
    "a row of types in a circle": f"(:types {' '.join(f't{n} - t{(n + 1) % MANY}' for n in range(MANY))})",
    "types above many": f"(:types {' '.join(f't{n}' for n in range(MANY))} - (either a b c))",
    "many predicates": f"(:predicates {' '.join(f'(p{n})' for n in range(MANY))})",
    "a long conjunction": f"(:predicates (p)) (:action a :effect (and {'(p)' * MANY}))",
    "an unknown section behind much": f"(:predicates {'(p)' * MANY}) (:foo)",
    "a mistake behind much": f"(:predicates (p)) (:action a :effect (and {'(p)' * MANY} (not)))",
    "nothing but words": "w " * MANY,
    "nothing but keywords": ":action " * MANY,
    "nothing but variables": "?" * MANY,
    "a comment without an end": f"; {'(' * MANY}",
    "names of two cases": f"(:predicates {' '.join(f'(p{n})' for n in range(MANY))} (P0))",
}


@pytest.mark.parametrize("name", share(LARGE, 3))
def test_large_domain_takes_little_time(name: str) -> None:
    text = LARGE[name]
    start = time.process_time()
    error = None
    try:
        parse_domain(f"(define (domain d)\n(:requirements :typing)\n{text})", "d.pddl")
    except PddlError as caught:
        error = caught
    assert time.process_time() - start < 5
    assert error is None or (error.file == "d.pddl" and error.line is not None)


@pytest.mark.parametrize("text", share(["(p a)", "(not (p a))", "(= (f) 1)", "(p a) ; (", "(p a b)"], 2))
def test_large_problem_takes_little_time(text: str) -> None:
    domain = parse_domain("(define (domain d) (:constants a) (:predicates (p ?x)) (:functions (f)))")
    start = time.process_time()
    facts = "\n".join([text] * MANY)
    with suppress(PddlError):
        parse_problem(f"(define (problem x) (:domain d) (:init {facts}) (:goal (p a)))", domain, "x.pddl")
    assert time.process_time() - start < 5
