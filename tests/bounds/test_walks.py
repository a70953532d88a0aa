"""Graphs that others send: a walk takes as long as there are nodes, however they share children."""

from __future__ import annotations

import pytest

from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.pddl import parse_formula
from cxbridge.executive.problem.truth import holds
from cxbridge_studio.explain.preconditions import Preconditions
from cxbridge_web.fawkes import formulas

LEVELS = 40


def test_a_formula_whose_variables_have_too_many_choices_is_refused():
    variables = " ".join(f"?v{number}" for number in range(9))
    formula = parse_formula(f"(exists ({variables} - place) (at ?v0 ?v8))")
    with pytest.raises(PddlError, match="cases"):
        holds(formula, [], {}, lambda _types: [f"p{number}" for number in range(9)])


def twice(level: int, part_of: str) -> list[dict[str, str]]:
    """Return two formulas of one id, each with the formulas of the next level in it."""
    return [{"id": f"f{level}", "part-of": part_of, "type": "conjunction"} for _ in range(2)]


LADDER = [slots for level in range(LEVELS) for slots in twice(level, f"f{level - 1}" if level else "go")]
LEAF = {
    "id": "leaf",
    "part-of": f"f{LEVELS - 1}",
    "predicate": "at",
    "param-names": "",
    "param-constants": "",
}


def test_the_parts_of_a_recorded_precondition_are_looked_at_once():
    facts = {"pddl-formula": LADDER, "pddl-predicate": [LEAF], "domain-fact": []}
    assert Preconditions(facts.__getitem__).blame("go", {}) == ["(at) is false"]


def test_the_parts_of_a_precondition_for_the_web_are_looked_at_once(monkeypatch: pytest.MonkeyPatch):
    known = {"pddl-formula": LADDER, "pddl-predicate": [LEAF], "pddl-grounding": [{"id": "g"}]}
    known["grounded-pddl-formula"] = [
        {"grounding": "g", "formula-id": slots["id"], "is-satisfied": "FALSE"} for slots in LADDER
    ]
    known["grounded-pddl-predicate"] = [{"grounding": "g", "predicate-id": "leaf", "is-satisfied": "FALSE"}]
    monkeypatch.setattr(formulas, "facts", lambda _call, template: known[template])
    made = formulas.Known.of(None)  # type: ignore[arg-type]
    assert sum(len(nodes) for nodes in made.nodes.values()) == LEVELS + 1


def test_a_goal_tree_of_plansys2_whose_nodes_share_children_is_refused():
    pytest.importorskip("rosbags", reason="the extra ros2 is not installed")
    from cxbridge_ros2.experts.nodes import NodeCodec, TreeNodeKind

    empty = {"expression_type": 0, "modifier_type": 0, "name": "", "parameters": [], "value": 0.0}
    nodes = [
        {**empty, "node_type": int(TreeNodeKind.AND), "node_id": at, "children": [at + 1, at + 1]}
        for at in range(31)
    ]
    nodes.append(
        {**empty, "node_type": int(TreeNodeKind.PREDICATE), "node_id": 31, "children": [], "name": "a"}
    )
    with pytest.raises(CxbridgeError, match="one parent"):
        NodeCodec("jazzy").formula({"nodes": nodes})
