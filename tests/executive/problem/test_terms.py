"""A constant of a domain is one wherever terms are shown, whatever it is called."""

from __future__ import annotations

import pytest

from cxbridge.clipstext.terms import constants_of
from cxbridge.executive.features.pddl_parser import _assert_rows
from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.executive.pddl import domain_facts, format_domain, parse_domain
from cxbridge.executive.problem.domain import domain_of_facts
from cxbridge_studio.explain.preconditions import ground
from cxbridge_web.fawkes.formulas import Known, tree

_NAMES = ["FALSE", "TRUE", "missing", "UNKNOWN", "c", "Nil"]


def test_constants():
    assert constants_of(["x", "c", "y"], ["nil", "FALSE"]) == [None, "FALSE", None]
    assert constants_of([], ["nil"]) == []


@pytest.mark.parametrize("name", _NAMES)
def test_a_constant_in_an_explanation(name: str):
    predicate = {"predicate": "at", "param-names": "x c", "param-constants": f"nil {name}"}
    assert ground(predicate, {"x": "r1", "c": "wrong"}) == ("at", "r1", name)


@pytest.mark.parametrize("name", _NAMES)
def test_a_constant_in_a_tree_of_rest(name: str):
    terms = {"param-names": ("x", "c"), "param-constants": ("nil", name)}
    atom = {"id": "a", "part-of": "go", "predicate": "at", **terms}
    grounding = {"id": "g", "param-names": ("x", "c"), "param-values": ("r1", "wrong")}
    known = Known({"g": grounding}, {"go": [(True, atom)]}, {("g", "a"): True})
    found = tree(known, "go", grounding, exact=False)
    assert found is not None
    assert found["param-values"] == ["r1", name]


@pytest.mark.parametrize("name", _NAMES)
def test_a_constant_in_a_domain_of_facts(env, name: str):
    text = f"""(define (domain domain) (:requirements :strips :typing :negative-preconditions)
      (:types room - object) (:constants {name} - room) (:predicates (in ?p - room))
      (:action go :parameters (?a - room) :precondition (and (in ?a) (not (in {name})))
        :effect (in {name})))"""
    for file in ("saliences", "plan", "goal", "domain"):
        assert env.batch(CORE_DIR / "cx" / f"{file}.clp")
    _assert_rows(env, domain_facts(parse_domain(text)))
    made = domain_of_facts(env, None)
    assert made is not None
    assert f"(and (in ?a) (not (in {name})))" in format_domain(made)
