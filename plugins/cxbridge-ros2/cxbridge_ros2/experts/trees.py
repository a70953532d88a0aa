"""Conversion between formulas and the trees in PlanSys2's messages.

A tree is a list of nodes. A node has the indices of its children, and the first node is the root. The numbers
of operators follow those of the kinds of nodes. Since Jazzy has added kinds, the operators have other numbers
in older distributions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum
from typing import Any, Final

from cxbridge.errors import Ros2Error
from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Constant,
    Formula,
    FunctionTerm,
    Ground,
    Not,
    NumericChange,
    Or,
    Quantified,
    Term,
    TermComparison,
    TypedNames,
    Variable,
    number_of,
)
from cxbridge.executive.pddl.printer import format_formula, format_number, format_term
from cxbridge_ros2.experts.definitions import BEFORE_JAZZY
from cxbridge_ros2.messages import Message


class TreeNodeKind(IntEnum):
    """The kind of a node in plansys2_msgs/msg/Node. Jazzy added the last three."""

    UNKNOWN = 0
    AND = 1
    OR = 2
    NOT = 3
    ACTION = 4
    PREDICATE = 5
    FUNCTION = 6
    EXPRESSION = 7
    CHANGE = 8
    NUMBER = 9
    CONSTANT = 10
    PARAMETER = 11
    EXISTS = 12


# Operators in the order of their numbers.
_COMPARISONS: Final = ("=", ">=", ">", "<=", "<")
_OPERATORS: Final = (*_COMPARISONS, "*", "/", "+", "-")
_CHANGES: Final = ("assign", "increase", "decrease", "scale-up", "scale-down")
# Limit of the depth of a tree, far below Python's recursion limit, since clients may send any tree.
_MAX_DEPTH: Final = 200

# Returns the types of the parameters of a predicate or a function by its name; empty if the name is unknown.
FindParameterTypes = Callable[[str], tuple[str, ...]]


class TreeCodec:
    """Converts formulas to trees and back, for the PlanSys2 of a ROS distribution."""

    def __init__(self, distribution: str) -> None:
        self._is_before_jazzy = distribution in BEFORE_JAZZY
        # NUMBER is the last kind before Jazzy
        self._kinds = [*TreeNodeKind][: TreeNodeKind.NUMBER + 1 if self._is_before_jazzy else None]
        self._operator_numbers = {
            operator: number for number, operator in enumerate((*_OPERATORS, *_CHANGES), len(self._kinds))
        }
        self._operators = {number: operator for operator, number in self._operator_numbers.items()}

    # --- to messages

    def encode_formula(
        self,
        formula: Formula | None,
        names: Mapping[str, str],
        find_types: FindParameterTypes = lambda _name: (),
    ) -> Message:
        """Return a formula as a tree; None gives an empty tree.

        :param names: names that replace variables, by variable.
        :param find_types: finds the types for nodes of predicates and functions; by default, they have none.
        :raises Ros2Error: if PlanSys2's messages cannot express the formula.
        """
        nodes: list[Message] = []
        if formula is not None:
            _TreeWriter(
                nodes, names, find_types, self._operator_numbers, is_before_jazzy=self._is_before_jazzy
            ).add(formula)
        return {"nodes": nodes}

    # --- from messages

    def decode_tree(self, tree: Mapping[str, Any], *, allows_changes: bool = False) -> Formula:
        """Return a tree as a formula.

        :param allows_changes: whether numeric changes are allowed.
        :raises Ros2Error: if the tree is not a formula.
        """
        return _TreeReader(
            tree["nodes"], self._operators, self._kinds, allows_changes=allows_changes
        ).decode_tree()


class _TreeReader:
    """Decodes the formula in the nodes of a message."""

    def __init__(
        self,
        nodes: list[Message],
        operators: Mapping[int, str],
        kinds: list[TreeNodeKind],
        *,
        allows_changes: bool,
    ) -> None:
        self._nodes, self._operators, self._kinds = nodes, operators, kinds
        self._allows_changes = allows_changes
        self._visited: set[int] = set()

    def decode_tree(self, index: int = 0, depth: int = 0) -> Formula:
        """Return the formula of a node and its children.

        :raises Ros2Error: if these nodes are not a formula.
        """
        node, kind = self._visit_node(index, depth)
        match kind:
            case TreeNodeKind.PREDICATE:
                return Atom(node["name"], tuple(map(_parse_term, _list_parameter_names(node))))
            case TreeNodeKind.EXPRESSION:
                operator, left, right = self._decode_operation(node["expression_type"], node, depth)
                if operator not in _COMPARISONS:
                    raise Ros2Error(f"'{operator}' is not a comparison")
                return TermComparison(operator, left, right)
            case TreeNodeKind.CHANGE if self._allows_changes:
                return NumericChange(*self._decode_operation(node["modifier_type"], node, depth))
        return self._make_composite(
            node, kind, tuple(self.decode_tree(child, depth + 1) for child in node["children"])
        )

    def _make_composite(self, node: Message, kind: TreeNodeKind, parts: tuple[Formula, ...]) -> Formula:
        match kind, parts:
            case TreeNodeKind.AND, _:
                return And(parts)
            case TreeNodeKind.OR, _:
                return Or(parts)
            case TreeNodeKind.NOT, (part,):
                return Not(part)
            case TreeNodeKind.EXISTS, (part,):
                groups = tuple(
                    TypedNames(
                        (parameter["name"].removeprefix("?"),),
                        (parameter["type"],) if parameter["type"] else (),
                    )
                    for parameter in node["parameters"]
                )
                return Quantified("exists", groups, part)
        raise Ros2Error(
            f"a node of the type {node['node_type']} with {len(parts)} children is not a condition"
        )

    def _decode_term(self, index: int, depth: int) -> Term:
        node, kind = self._visit_node(index, depth)
        match kind:
            case TreeNodeKind.NUMBER:
                return Constant(format_number(node["value"]))
            case TreeNodeKind.FUNCTION:
                return FunctionTerm(node["name"], tuple(map(_parse_term, _list_parameter_names(node))))
            case TreeNodeKind.EXPRESSION:
                operator, left, right = self._decode_operation(node["expression_type"], node, depth)
                if operator in _OPERATORS and operator not in _COMPARISONS:
                    return FunctionTerm(operator, (left, right))
            case TreeNodeKind.CONSTANT | TreeNodeKind.PARAMETER:
                return _parse_term(node["name"])
        raise Ros2Error(f"a node of the type {node['node_type']} is neither a number nor an object")

    def _decode_operation(self, operator_number: int, node: Message, depth: int) -> tuple[str, Term, Term]:
        """Return the operator of a node, and the left and the right operand."""
        operator = self._operators.get(operator_number)
        match node["children"]:
            case [left, right] if operator is not None:
                return operator, self._decode_term(left, depth + 1), self._decode_term(right, depth + 1)
            case children:
                raise Ros2Error(
                    f"an operation of type {operator_number} with {len(children)} children is not valid"
                )

    def _visit_node(self, index: int, depth: int) -> tuple[Message, TreeNodeKind]:
        """Return a node and its kind, UNKNOWN for a number that the distribution does not have.

        :raises Ros2Error: if the index is invalid, the tree is too deep, or the node was visited before.
        """
        if index >= len(self._nodes):
            raise Ros2Error(f"the tree has no node {index}")
        if depth > _MAX_DEPTH:
            raise Ros2Error(f"the tree is deeper than {_MAX_DEPTH} nodes")
        # below N nodes with two parents each, a node would be decoded 2^N times
        if index in self._visited:
            raise Ros2Error(f"node {index} of the tree has two parents")
        self._visited.add(index)
        kind = self._nodes[index]["node_type"]
        return self._nodes[index], TreeNodeKind(kind) if kind in self._kinds else TreeNodeKind.UNKNOWN


class _TreeWriter:
    """Adds the nodes of a formula to a list."""

    def __init__(
        self,
        nodes: list[Message],
        variable_names: Mapping[str, str],
        find_types: FindParameterTypes,
        operator_numbers: Mapping[str, int],
        *,
        is_before_jazzy: bool,
    ) -> None:
        self._nodes, self._variable_names, self._find_types = nodes, variable_names, find_types
        self._operator_numbers, self._is_before_jazzy = operator_numbers, is_before_jazzy

    def add(self, formula: Formula) -> int:  # noqa: PLR0911 - a return for each kind of formula
        """Add the nodes of a formula, and return the index of its root.

        :raises Ros2Error: if PlanSys2's messages cannot express the formula.
        """
        match formula.reduced:  # PlanSys2 has no kind of node for an implication
            case Atom(predicate=name, arguments=terms):
                return self._add_ground(TreeNodeKind.PREDICATE, name, terms)
            case And(parts=parts):
                return self._add_node(TreeNodeKind.AND, parts)
            case Or(parts=parts):
                return self._add_node(TreeNodeKind.OR, parts)
            case Not(part=part):
                return self._add_node(TreeNodeKind.NOT, (part,))
            case TermComparison(operator=operator, left=left, right=right):
                number = self._operator_numbers[operator]
                return self._add_node(TreeNodeKind.EXPRESSION, (left, right), expression_type=number)
            case NumericChange(operator=operator, target=left, amount=right):
                number = self._operator_numbers[operator]
                return self._add_node(TreeNodeKind.CHANGE, (left, right), modifier_type=number)
            case Quantified(quantifier="exists", variables=groups, part=part) if not self._is_before_jazzy:
                parameters = [
                    make_param(f"?{name}", group.types[0] if group.types else "")
                    for group in groups
                    for name in group.names
                ]
                return self._add_node(TreeNodeKind.EXISTS, (part,), parameters=parameters)
            case _:
                raise Ros2Error(f"PlanSys2's messages cannot express {format_formula(formula)}")

    def _add_node(self, kind: TreeNodeKind, children: Sequence[Formula | Term] = (), **fields: Any) -> int:
        index = len(self._nodes)
        node = {"node_type": int(kind), "node_id": index, **fields}
        self._nodes.append(node)  # before its children, since the root is the first node
        node["children"] = [
            self.add(child) if isinstance(child, Formula) else self._add_term(child) for child in children
        ]
        return index

    def _add_ground(self, kind: TreeNodeKind, name: str, terms: tuple[Term, ...]) -> int:
        types = (*self._find_types(name), *[""] * len(terms))  # an unknown predicate has no types
        parameters = [
            make_param(self._format_term_name(term), type_name)
            for term, type_name in zip(terms, types, strict=False)
        ]
        return self._add_node(kind, name=name, parameters=parameters)

    def _add_term(self, term: Term) -> int:
        match term:
            case FunctionTerm(function=name, arguments=terms) if name not in _OPERATORS:
                return self._add_ground(TreeNodeKind.FUNCTION, name, terms)
            case FunctionTerm(function=operator, arguments=(left, right)):
                number = self._operator_numbers[operator]
                return self._add_node(TreeNodeKind.EXPRESSION, (left, right), expression_type=number)
            case FunctionTerm():
                raise Ros2Error(f"PlanSys2's messages cannot express {format_term(term)}")
            case Constant(name=text) if (value := number_of(text)) is not None:
                return self._add_node(TreeNodeKind.NUMBER, value=value)
            case _ if self._is_before_jazzy:
                raise Ros2Error(f"PlanSys2's messages can only compare numbers, not {format_term(term)}")
            case _:
                kind = TreeNodeKind.PARAMETER if isinstance(term, Variable) else TreeNodeKind.CONSTANT
                return self._add_node(kind, name=self._format_term_name(term))

    def _format_term_name(self, term: Term) -> str:
        if isinstance(term, Variable):
            return self._variable_names.get(term.name, f"?{term.name}")
        return format_term(term)


def make_param(name: str, type_name: str = "", subtypes: list[str] | None = None) -> Message:
    """Return a plansys2_msgs/msg/Param for a parameter or an instance."""
    return {"name": name, "type": type_name, "sub_types": subtypes or []}


def make_ground_node(
    kind: TreeNodeKind, ground: Ground, types: Mapping[str, str], value: float = 0.0
) -> Message:
    """Return the node of a predicate or a function.

    :param types: the types of the instances, by name.
    """
    name, arguments = ground
    parameters = [make_param(argument, types.get(argument, "")) for argument in arguments]
    return {"node_type": int(kind), "name": name, "parameters": parameters, "value": value}


def parse_ground_node(node: Message) -> Ground:
    """Return the predicate or function in a node."""
    return node["name"], tuple(_list_parameter_names(node))


def _list_parameter_names(node: Message) -> list[str]:
    return [parameter["name"] for parameter in node["parameters"]]


def _parse_term(name: str) -> Term:
    return Variable(name.removeprefix("?")) if name.startswith("?") else Constant(name)
