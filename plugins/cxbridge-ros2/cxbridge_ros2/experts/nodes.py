"""Conversion between formulas and the trees of nodes in PlanSys2's messages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
    Imply,
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
from cxbridge_ros2.experts.names import BEFORE_JAZZY
from cxbridge_ros2.messages import Message


class TreeNodeKind(IntEnum):
    """The kind of a node. Jazzy added the last three."""

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
_SIGNS: Final = ("=", ">=", ">", "<=", "<", "*", "/", "+", "-")

_COMPARING: Final = _SIGNS[:5]
_CHANGES: Final = ("assign", "increase", "decrease", "scale-up", "scale-down")
# Clients may send any tree; this depth stays far below Python's recursion limit.
_MOST_DEEP: Final = 200
_PAIR: Final = 2

# Returns the parameter types of a predicate or a function.
TypesOf = Callable[[str], tuple[str, ...]]


class NodeCodec:
    """Converter for one distribution: Jazzy has changed the numbers."""

    def __init__(self, distribution: str) -> None:
        self._is_old = distribution in BEFORE_JAZZY
        first = max(TreeNodeKind) + 1 if not self._is_old else TreeNodeKind.NUMBER + 1
        self._numbers = {sign: first + index for index, sign in enumerate((*_SIGNS, *_CHANGES))}
        self._signs = {number: sign for sign, number in self._numbers.items()}

    # ---- to messages

    def tree(
        self, formula: Formula | None, names: Mapping[str, str], types_of: TypesOf = lambda _name: ()
    ) -> Message:
        """Return the tree of a formula; None gives an empty tree.

        :param names: values of variables.
        :raises Ros2Error: if PlanSys2's messages cannot express the formula.
        """
        nodes: list[Message] = []
        if formula is not None:
            _TreeMaker(nodes, names, types_of, self._numbers, is_old=self._is_old).formula(formula)
        return {"nodes": nodes}

    # ---- from messages

    def formula(self, tree: Mapping[str, Any], *, effects: bool = False) -> Formula:
        """Return the formula of a tree.

        :param effects: whether numeric changes are allowed.
        """
        return _TreeReader(tree["nodes"], self._signs, is_old=self._is_old, effects=effects).formula()


class _TreeReader:
    def __init__(
        self, nodes: list[Message], signs: Mapping[int, str], *, is_old: bool, effects: bool
    ) -> None:
        self._nodes = nodes
        self._signs = signs
        self._kinds = [*TreeNodeKind][: TreeNodeKind.NUMBER + 1] if is_old else [*TreeNodeKind]
        self._effects = effects
        self._read: set[int] = set()

    def formula(self, at: int = 0, depth: int = 0) -> Formula:
        """Return the formula below a node."""
        node, kind = self._node(at, depth)
        if kind is TreeNodeKind.PREDICATE:
            return Atom(node["name"], tuple(map(_term_of, _names(node))))
        if kind is TreeNodeKind.EXPRESSION:
            sign, left, right = self._pair(node["expression_type"], node, depth)
            if sign in _COMPARING:
                return TermComparison(sign, left, right)
            raise Ros2Error(f"'{sign}' is a number, not a condition")
        if kind is TreeNodeKind.CHANGE and self._effects:
            return NumericChange(*self._pair(node["modifier_type"], node, depth))
        return self._joined(node, kind, tuple(self.formula(each, depth + 1) for each in node["children"]))

    def _joined(self, node: Message, kind: TreeNodeKind, parts: tuple[Formula, ...]) -> Formula:
        if kind is TreeNodeKind.AND:
            return And(parts)
        if kind is TreeNodeKind.OR:
            return Or(parts)
        if kind is TreeNodeKind.NOT and len(parts) == 1:
            return Not(parts[0])
        if kind is TreeNodeKind.EXISTS and len(parts) == 1:
            groups = tuple(
                TypedNames((each["name"].removeprefix("?"),), (each["type"],) if each["type"] else ())
                for each in node["parameters"]
            )
            return Quantified("exists", groups, parts[0])
        raise Ros2Error(
            f"a node of the type {node['node_type']} with {len(parts)} children is not a condition"
        )

    def _term(self, at: int, depth: int) -> Term:
        node, kind = self._node(at, depth)
        if kind is TreeNodeKind.NUMBER:
            return Constant(format_number(node["value"]))
        if kind is TreeNodeKind.FUNCTION:
            return FunctionTerm(node["name"], tuple(map(_term_of, _names(node))))
        if kind is TreeNodeKind.EXPRESSION:
            sign, left, right = self._pair(node["expression_type"], node, depth)
            if sign in _SIGNS and sign not in _COMPARING:
                return FunctionTerm(sign, (left, right))
        if kind in (TreeNodeKind.CONSTANT, TreeNodeKind.PARAMETER):
            return _term_of(node["name"])
        raise Ros2Error(f"a node of the type {node['node_type']} is no number")

    def _pair(self, number: int, node: Message, depth: int) -> tuple[str, Term, Term]:
        sign, children = self._signs.get(number, ""), node["children"]
        if not sign or len(children) != _PAIR:
            raise Ros2Error(f"an expression of the type {number} with {len(children)} children is none")
        left, right = (self._term(child, depth + 1) for child in children)
        return sign, left, right

    def _node(self, at: int, depth: int) -> tuple[Message, TreeNodeKind]:
        if at >= len(self._nodes):
            raise Ros2Error(f"the tree has no node {at}")
        if depth > _MOST_DEEP:
            raise Ros2Error(f"the tree is deeper than {_MOST_DEEP} nodes")
        # A node with two parents would be read 2^N times below N such nodes.
        if at in self._read:
            raise Ros2Error(f"the tree has node {at} in two places: a node has one parent")
        self._read.add(at)
        kind = self._nodes[at]["node_type"]
        return self._nodes[at], TreeNodeKind(kind) if kind in self._kinds else TreeNodeKind.UNKNOWN


class _TreeMaker:
    def __init__(
        self,
        nodes: list[Message],
        names: Mapping[str, str],
        types_of: TypesOf,
        numbers: Mapping[str, int],
        *,
        is_old: bool,
    ) -> None:
        self._nodes = nodes
        self._names = names
        self._types_of = types_of
        self._numbers = numbers
        self._is_old = is_old

    def _add(self, kind: TreeNodeKind, **fields: Any) -> Message:
        node = {"node_type": int(kind), "node_id": len(self._nodes), "children": [], **fields}
        self._nodes.append(node)
        return node

    def formula(self, formula: Formula) -> int:
        """Add the nodes of a formula and return the number of the first."""
        match formula:
            case Atom(predicate=name, arguments=terms):
                number = self._ground(TreeNodeKind.PREDICATE, name, terms)
            case And(parts=parts) | Or(parts=parts):
                number = self._joined(
                    TreeNodeKind.AND if isinstance(formula, And) else TreeNodeKind.OR, parts
                )
            case Not(part=part):
                number = self._joined(TreeNodeKind.NOT, (part,))
            case Imply(condition=first, consequence=second):
                number = self._joined(TreeNodeKind.OR, (Not(first), second))
            case TermComparison(operator=sign, left=left, right=right):
                number = self._pair(TreeNodeKind.EXPRESSION, "expression_type", sign, (left, right))
            case NumericChange(operator=sign, target=left, amount=right):
                number = self._pair(TreeNodeKind.CHANGE, "modifier_type", sign, (left, right))
            case Quantified(quantifier="exists") if not self._is_old:
                number = self._exists(formula)
            case _:
                raise Ros2Error(f"PlanSys2's messages have no words for {format_formula(formula)}")
        return number

    def _joined(self, kind: TreeNodeKind, parts: tuple[Formula, ...]) -> int:
        node = self._add(kind)
        node["children"] += [self.formula(part) for part in parts]
        return int(node["node_id"])

    def _pair(self, kind: TreeNodeKind, field: str, sign: str, terms: tuple[Term, Term]) -> int:
        node = self._add(kind, **{field: self._numbers[sign]})
        node["children"] += [self._term(term) for term in terms]
        return int(node["node_id"])

    def _exists(self, formula: Quantified) -> int:
        parameters = [
            param(f"?{name}", group.types[0] if group.types else "")
            for group in formula.variables
            for name in group.names
        ]
        node = self._add(TreeNodeKind.EXISTS, parameters=parameters)
        node["children"].append(self.formula(formula.part))
        return int(node["node_id"])

    def _ground(self, kind: TreeNodeKind, name: str, terms: tuple[Term, ...]) -> int:
        types = (*self._types_of(name), *[""] * len(terms))
        parameters = [param(self._name(term), types[index]) for index, term in enumerate(terms)]
        return int(self._add(kind, name=name, parameters=parameters)["node_id"])

    def _term(self, term: Term) -> int:
        match term:
            case FunctionTerm(function=name, arguments=terms):
                if name not in _SIGNS:
                    return self._ground(TreeNodeKind.FUNCTION, name, terms)
                if len(terms) == _PAIR:
                    return self._pair(TreeNodeKind.EXPRESSION, "expression_type", name, (terms[0], terms[1]))
                raise Ros2Error(f"PlanSys2's messages have no words for {format_term(term)}")
            case Constant(name=text) if (number := number_of(text)) is not None:
                return int(self._add(TreeNodeKind.NUMBER, value=number)["node_id"])
            case _ if self._is_old:
                raise Ros2Error(f"PlanSys2's messages compare numbers only, not {format_term(term)}")
            case _:
                kind = TreeNodeKind.PARAMETER if isinstance(term, Variable) else TreeNodeKind.CONSTANT
                return int(self._add(kind, name=self._name(term))["node_id"])

    def _name(self, term: Term) -> str:
        if isinstance(term, Variable):
            return self._names.get(term.name, f"?{term.name}")
        return format_term(term)


def param(name: str, kind: str = "", subtypes: list[str] | None = None) -> Message:
    """Return a parameter or an instance."""
    return {"name": name, "type": kind, "sub_types": subtypes or []}


def ground_node(kind: TreeNodeKind, ground: Ground, types: Mapping[str, str], value: float = 0.0) -> Message:
    """Return the node of a predicate or a function.

    :param types: types of the instances.
    """
    name, arguments = ground
    parameters = [param(each, types.get(each, "")) for each in arguments]
    return {"node_type": int(kind), "name": name, "parameters": parameters, "value": value}


def ground_in(node: Message) -> Ground:
    """Return the predicate or function in a node."""
    return node["name"], tuple(_names(node))


def _names(node: Message) -> list[str]:
    return [each["name"] for each in node["parameters"]]


def _term_of(name: str) -> Term:
    return Variable(name.removeprefix("?")) if name.startswith("?") else Constant(name)
