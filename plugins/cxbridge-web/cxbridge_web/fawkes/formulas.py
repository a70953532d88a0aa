"""Preconditions of plan actions as trees of grounded PDDL formulas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.values import constants_of
from cxbridge.executive.host.facts.copying import FactCopy
from cxbridge_web.fawkes.slots import SlotError, Slots, read_flag, read_text, read_texts
from cxbridge_web.models import Model


class PDDLGrounding(Model, kw_only=True, rename="kebab"):
    """The values of the parameters of a formula."""

    id: str
    param_names: list[str]
    param_values: list[str]


class _GroundedNode(Model, kw_only=True, rename="kebab"):
    """A node of a grounded formula."""

    name: str
    type: str
    is_satisfied: bool
    param_names: list[str]
    param_values: list[str]
    param_constants: list[str]
    child: list[GroundedFormula | GroundedPredicate]


class GroundedFormula(_GroundedNode, kw_only=True):
    """A formula that consists of formulas."""


class GroundedPredicate(_GroundedNode, kw_only=True):
    """An atom."""


# The deftemplates of formulas.
FORMULA_TEMPLATES: Final = (
    "pddl-grounding",
    "pddl-formula",
    "pddl-predicate",
    "grounded-pddl-formula",
    "grounded-pddl-predicate",
)

_MAX_DEPTH: Final = 64  # limit of nested formulas, since asserted facts may form a ring


@dataclass(frozen=True, slots=True)
class Groundings:
    """The groundings of formulas, with all facts about the formulas.

    :param slots: the slots of each grounding, by its id.
    :param nodes: the child nodes, by the id of the parent: whether the node is an atom, and its slots.
    :param node_is_satisfied: whether a node is satisfied, by the ids of the grounding and the node.
    """

    slots: Mapping[str, Slots]
    nodes: Mapping[str, Sequence[tuple[bool, Slots]]]
    node_is_satisfied: Mapping[tuple[str, str], bool]

    @classmethod
    def read(cls, facts: FactCopy) -> Groundings:
        """Return the groundings in copied facts; empty if the facts have no grounding."""
        nodes: dict[str, list[tuple[bool, Slots]]] = {}
        node_is_satisfied: dict[tuple[str, str], bool] = {}
        groundings = {str(slots.get("id", "")): slots for slots in facts.facts_of("pddl-grounding")}
        if not groundings:
            return cls({}, {}, {})
        # by id, so that a formula has one parent: a formula below N formulas with two parents each would be
        # visited 2^N times
        formulas = {str(slots.get("id", "")): slots for slots in facts.facts_of("pddl-formula")}.values()
        for is_atom, rows in ((False, formulas), (True, facts.facts_of("pddl-predicate"))):
            for slots in rows:
                nodes.setdefault(str(slots.get("part-of", "")), []).append((is_atom, slots))
        for template, slot in (
            ("grounded-pddl-formula", "formula-id"),
            ("grounded-pddl-predicate", "predicate-id"),
        ):
            for slots in facts.facts_of(template):
                with suppress(SlotError):  # as in Fawkes, an unreadable fact is skipped
                    node_is_satisfied[read_text(slots, "grounding"), read_text(slots, slot)] = read_flag(
                        slots, "is-satisfied"
                    )
        return cls(groundings, nodes, node_is_satisfied)


def make_precondition(
    groundings: Groundings, operator: str, grounding: Slots
) -> GroundedFormula | GroundedPredicate | None:
    """Return an operator's precondition in a grounding; None without a precondition.

    As in Fawkes, the last of several preconditions is returned.

    :raises SlotError: if a fact is unreadable, or formulas are nested too deep.
    """
    root = None
    grounding_id = read_text(grounding, "id")
    for is_atom, slots in groundings.nodes.get(operator, ()):
        if (grounding_id, read_text(slots, "id")) in groundings.node_is_satisfied:
            root = _make_node(groundings, is_atom, slots, grounding, 0)
    return root


def _make_node(
    groundings: Groundings, is_atom: bool, slots: Slots, grounding: Slots, depth: int
) -> GroundedFormula | GroundedPredicate:
    if depth > _MAX_DEPTH:
        raise SlotError("formulas are nested too deep, or a formula is part of itself")
    node_id, grounding_id = read_text(slots, "id"), read_text(grounding, "id")
    names: list[str] = []
    constants: list[str] = []
    values: list[str] = []
    if is_atom:
        names, constants = read_texts(slots, "param-names"), read_texts(slots, "param-constants")
        # not strict, because an asserted fact may have more names than values
        grounding_values = dict(
            zip(read_texts(grounding, "param-names"), read_texts(grounding, "param-values"), strict=False)
        )
        values = [
            grounding_values.get(name, "") if constant is None else constant
            for name, constant in zip(names, constants_of(names, constants), strict=True)
        ]
    model = GroundedPredicate if is_atom else GroundedFormula
    return model(
        name=read_text(slots, "predicate") if is_atom else node_id,
        type="atom" if is_atom else read_text(slots, "type"),
        is_satisfied=groundings.node_is_satisfied.get((grounding_id, node_id), False),
        param_names=names,
        param_values=values,
        param_constants=constants,
        child=[
            _make_node(groundings, is_child_atom, child, grounding, depth + 1)
            for is_child_atom, child in groundings.nodes.get(node_id, ())
            if (grounding_id, read_text(child, "id")) in groundings.node_is_satisfied
        ],
    )
