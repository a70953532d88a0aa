"""A constant of a domain stays a constant in all terms, whatever its name."""

from __future__ import annotations

import pytest

from cxbridge.clipstext.values import constants_of
from cxbridge.executive.features.pddl_parser import _assert_facts
from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.executive.pddl import domain_facts, format_formula, parse_domain
from cxbridge.executive.problem.conditions import FormulaMaker

NAMES = ["FALSE", "TRUE", "missing", "UNKNOWN", "c", "Nil"]


def test_constants():
    assert constants_of(["x", "c", "y"], ["nil", "FALSE"]) == [None, "FALSE", None]
    assert constants_of([], ["nil"]) == []


@pytest.mark.parametrize("name", NAMES)
def test_constant_in_domain_of_facts(env, name: str):
    text = f"""(define (domain domain) (:requirements :strips :typing :negative-preconditions)
      (:types room - object) (:constants {name} - room) (:predicates (in ?p - room))
      (:action go :parameters (?a - room) :precondition (and (in ?a) (not (in {name})))
        :effect (in {name})))"""
    for file in ("saliences", "plan", "goal", "domain"):
        assert env.batch(CORE_DIR / "cx" / f"{file}.clp")
    _assert_facts(env, domain_facts(parse_domain(text)))
    formulas, atoms = (
        [slots for _, _, slots in env.facts(template)] for template in ("pddl-formula", "pddl-predicate")
    )
    made = FormulaMaker(formulas, atoms).operator_condition("go")
    assert made is not None
    assert format_formula(made) == f"(and (in ?a) (not (in {name})))"
