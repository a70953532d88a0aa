"""Preconditions of recorded actions."""

from __future__ import annotations

import pytest

from cxbridge_studio.explain.preconditions import Preconditions, ground_predicate
from tests.bounds.ladder import LADDER, LEAF
from tests.executive.problem.test_terms import NAMES


@pytest.mark.parametrize("name", NAMES)
def test_ground_predicate_has_constant(name: str):
    predicate = {"predicate": "at", "param-names": "x c", "param-constants": f"nil {name}"}
    assert ground_predicate(predicate, {"x": "r1", "c": "wrong"}) == ("at", "r1", name)


def test_parts_of_precondition_are_visited_once():
    facts = {"pddl-formula": LADDER, "pddl-predicate": [LEAF], "domain-fact": []}
    assert Preconditions(facts.__getitem__).describe_blame("go", {}) == ["(at) is false"]
