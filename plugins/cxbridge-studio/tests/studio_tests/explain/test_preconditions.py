"""The preconditions of recorded actions."""

from __future__ import annotations

import pytest

from cxbridge_studio.explain.preconditions import Preconditions, ground_predicate
from tests.bounds.ladder import LADDER, LEAF
from tests.executive.problem.test_terms import NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_constant_in_an_explanation(name: str):
    predicate = {"predicate": "at", "param-names": "x c", "param-constants": f"nil {name}"}
    assert ground_predicate(predicate, {"x": "r1", "c": "wrong"}) == ("at", "r1", name)


def test_the_parts_of_a_recorded_precondition_are_looked_at_once():
    facts = {"pddl-formula": LADDER, "pddl-predicate": [LEAF], "domain-fact": []}
    assert Preconditions(facts.__getitem__).describe_blame("go", {}) == ["(at) is false"]
