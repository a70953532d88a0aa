"""The preconditions of actions as trees of the REST API."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from cxbridge_web.fawkes.formulas import Groundings, make_precondition
from tests.bounds.ladder import LADDER, LEAF, LEVELS
from tests.executive.problem.test_terms import NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_constant_in_a_tree_of_rest(name: str):
    terms = {"param-names": ("x", "c"), "param-constants": ("nil", name)}
    atom = {"id": "a", "part-of": "go", "predicate": "at", **terms}
    grounding = {"id": "g", "param-names": ("x", "c"), "param-values": ("r1", "wrong")}
    groundings = Groundings({"g": grounding}, {"go": [(True, atom)]}, {("g", "a"): True})
    found = make_precondition(groundings, "go", grounding)
    assert found is not None
    assert found.param_values == ["r1", name]


def test_the_parts_of_a_precondition_for_the_web_are_looked_at_once():
    known = {"pddl-formula": LADDER, "pddl-predicate": [LEAF], "pddl-grounding": [{"id": "g"}]}
    known["grounded-pddl-formula"] = [
        {"grounding": "g", "formula-id": slots["id"], "is-satisfied": "FALSE"} for slots in LADDER
    ]
    known["grounded-pddl-predicate"] = [{"grounding": "g", "predicate-id": "leaf", "is-satisfied": "FALSE"}]
    facts: Any = SimpleNamespace(facts_of=known.__getitem__)
    made = Groundings.read(facts)
    assert sum(len(nodes) for nodes in made.nodes.values()) == LEVELS + 1
