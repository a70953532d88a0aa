"""The texts that engines read."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge_planning.engines.command import CommandPlanner
from cxbridge_planning.engines.texts import original_texts, plain_texts, rename_problem
from cxbridge_planning.errors import PlanningError

DOMAIN = """(define (domain yard) ; caf\u00e9
  (:TYPES pot bed -object) (:predicates (wet ?x - pot))
  (:action rain :effect (forall (?p - pot) (forall (?b - bed) (WET ?p)))))
"""
PROBLEM = "(define (problem problem) (:domain Yard)\n (:objects a -pot b -bed) (:init) (:goal (wet A)))"


def test_original_texts_keep_lines_of_user() -> None:
    domain = parse_domain(DOMAIN, "yard.pddl")
    texts = original_texts(domain, parse_problem(PROBLEM, domain, "p.pddl"))
    assert texts.files == ("yard.pddl", "p.pddl")
    assert texts.problem == PROBLEM
    assert texts.domain.splitlines()[1:] == DOMAIN.splitlines()[1:]
    assert texts.domain.isascii()


def test_changed_domain_is_printed_without_file_name() -> None:
    domain = parse_domain(DOMAIN, "yard.pddl")
    texts = original_texts(domain.changed(name="garden"), parse_problem(PROBLEM, domain, "p.pddl"))
    assert "(domain garden)" in texts.domain
    assert texts.files == ("", "p.pddl")


def test_plain_texts_have_only_common_forms() -> None:
    domain = parse_domain(DOMAIN)
    texts = plain_texts(domain, parse_problem(PROBLEM, domain))
    assert "(:requirements :typing)" in texts.domain
    assert "(forall (?p - pot ?b - bed) (wet ?p))" in texts.domain
    assert "(:domain yard)" in texts.problem
    assert "(:goal (wet a))" in texts.problem


def test_renamed_problem_keeps_lines() -> None:
    assert rename_problem(PROBLEM, "task") == PROBLEM.replace("problem problem", "problem task")


def test_error_of_program_names_file_of_user(tmp_path: Path) -> None:
    program = tmp_path / "refuses"
    # the path of Python may have a blank, which the first line of a script cannot have
    program.write_text('#!/bin/sh\necho "$1:2: no such type"\nexit 3\n')
    program.chmod(0o755)
    domain = parse_domain(DOMAIN, "yard.pddl")
    problem = parse_problem(PROBLEM, domain, "p.pddl")
    with pytest.raises(PlanningError, match=r"yard\.pddl:2: no such type"):
        CommandPlanner("popf", program=str(program)).solve(domain, problem)
