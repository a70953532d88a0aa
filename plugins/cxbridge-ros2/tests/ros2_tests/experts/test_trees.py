"""Formulas encoded as trees of nodes, with the numbers of each distribution."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest

pytest.importorskip("rosbags", reason="the extra ros2 is not installed")

from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import Ros2Error
from cxbridge.executive.pddl import format_formula, parse_formula
from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Constant,
    Formula,
    FunctionTerm,
    Not,
    Or,
    TermComparison,
    Variable,
)
from cxbridge_ros2.definitions import DISTRIBUTIONS
from cxbridge_ros2.experts.trees import TreeCodec

_NAMES = st.sampled_from(["a", "r2", "hall-1", "x_y"])
_ARGUMENTS = st.lists(st.one_of(_NAMES.map(Constant), _NAMES.map(Variable)), max_size=3).map(tuple)
_NUMBERS = st.integers(-999, 999).map(lambda number: Constant(str(number)))
_TERMS = st.recursive(
    st.one_of(_NUMBERS, st.builds(FunctionTerm, _NAMES, _ARGUMENTS)),
    lambda terms: st.builds(FunctionTerm, st.sampled_from("+-*/"), st.tuples(terms, terms)),
    max_leaves=4,
)
_FORMULAS = st.recursive(
    st.one_of(
        st.builds(Atom, _NAMES, _ARGUMENTS),
        st.builds(TermComparison, st.sampled_from(["=", "<", ">", "<=", ">="]), _TERMS, _TERMS),
    ),
    lambda parts: st.one_of(
        st.builds(And, st.lists(parts, max_size=3).map(tuple)),
        st.builds(Or, st.lists(parts, max_size=3).map(tuple)),
        st.builds(Not, parts),
    ),
    max_leaves=8,
)


def fill_fields(tree: dict[str, Any]) -> dict[str, Any]:
    """Return a tree with all fields, like a tree from the network."""
    defaults = {"expression_type": 0, "modifier_type": 0, "name": "", "parameters": [], "value": 0.0}
    return {"nodes": [{**defaults, **each} for each in tree["nodes"]]}


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
@given(formula=_FORMULAS)
def test_decoded_tree_equals_encoded_formula(distribution: str, formula: Formula):
    codec = TreeCodec(distribution)
    tree = codec.encode_formula(formula, {})
    assert codec.decode_tree(fill_fields(tree)) == formula
    assert [each["node_id"] for each in tree["nodes"]] == list(range(len(tree["nodes"])))


@pytest.mark.parametrize(
    ("distribution", "number"), [("humble", 11), ("iron", 11), ("jazzy", 14), ("kilted", 14)]
)
def test_comparison_has_number_of_distribution(distribution: str, number: int):
    tree = TreeCodec(distribution).encode_formula(parse_formula("(>= (battery r2) 1)"), {})
    assert tree["nodes"][0]["expression_type"] == number


@pytest.mark.parametrize(
    "text", ["(exists (?c - cup) (at ?c hall))", "(not (= ?a hall))", "(exists (?c) (at ?c ?p))"]
)
def test_jazzy_encodes_quantifiers_variables_and_equality(text: str):
    tree = TreeCodec("jazzy").encode_formula(parse_formula(text), {})
    assert format_formula(TreeCodec("jazzy").decode_tree(fill_fields(tree))) == text
    with pytest.raises(Ros2Error, match="PlanSys2's messages"):
        TreeCodec("iron").encode_formula(parse_formula(text), {})


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
@pytest.mark.parametrize("text", ["(forall (?c - cup) (at ?c hall))", "(>= (- (battery r2)) 1)"])
def test_inexpressible_formulas_are_refused(distribution: str, text: str):
    with pytest.raises(Ros2Error, match="cannot express"):
        TreeCodec(distribution).encode_formula(parse_formula(text), {})


def test_implication_is_encoded_as_disjunction():
    codec = TreeCodec("iron")
    tree = codec.encode_formula(parse_formula("(imply (a) (b))"), {})
    assert format_formula(codec.decode_tree(fill_fields(tree))) == "(or (not (a)) (b))"


@given(
    nodes=st.lists(
        st.fixed_dictionaries(
            {
                "node_type": st.integers(0, 15),
                "expression_type": st.integers(0, 30),
                "modifier_type": st.integers(0, 30),
                "children": st.lists(st.integers(0, 9), max_size=3),
                "name": st.text(max_size=5),
                "parameters": st.lists(
                    st.fixed_dictionaries({"name": st.text(max_size=3), "type": st.text(max_size=3)})
                ),
                "value": st.floats(),
            }
        ),
        max_size=9,
    )
)
def test_random_tree_is_formula_or_error(nodes: list[dict[str, Any]]):
    with suppress(Ros2Error):
        TreeCodec("jazzy").decode_tree({"nodes": nodes}, allows_changes=True)
