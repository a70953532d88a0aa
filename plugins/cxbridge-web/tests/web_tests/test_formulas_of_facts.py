"""The preconditions of actions as trees of the REST API."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from cxbridge_web.fawkes.formulas import Groundings, make_precondition
from tests.bounds.ladder import LADDER, LEAF, LEVELS
from tests.executive.problem.test_terms import NAMES


@pytest.mark.parametrize("name", NAMES)
def test_tree_has_constants_of_atom(name: str):
    terms = {"param-names": ("x", "c"), "param-constants": ("nil", name)}
    atom = {"id": "a", "part-of": "go", "predicate": "at", **terms}
    grounding = {"id": "g", "param-names": ("x", "c"), "param-values": ("r1", "wrong")}
    groundings = Groundings({"g": grounding}, {"go": [(True, atom)]}, {("g", "a"): True})
    tree = make_precondition(groundings, "go", grounding)
    assert tree is not None
    assert tree.param_values == ["r1", name]


def test_each_part_of_precondition_is_read_once():
    tables = {"pddl-formula": LADDER, "pddl-predicate": [LEAF], "pddl-grounding": [{"id": "g"}]}
    tables["grounded-pddl-formula"] = [
        {"grounding": "g", "formula-id": slots["id"], "is-satisfied": "FALSE"} for slots in LADDER
    ]
    tables["grounded-pddl-predicate"] = [{"grounding": "g", "predicate-id": "leaf", "is-satisfied": "FALSE"}]
    facts: Any = SimpleNamespace(facts_of=tables.__getitem__)
    groundings = Groundings.read(facts)
    assert sum(len(nodes) for nodes in groundings.nodes.values()) == LEVELS + 1
