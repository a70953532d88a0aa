"""The condition of a rule: its conditional elements (CEs), and the constraints of its patterns."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from math import inf

from msgspec import Struct

from cxbridge.clipstext.syntax import SyntaxNode, compact, literal

# A local variable. In CLIPS 6.4 a slot may follow, as in `?fact:slot`.
_VARIABLE = re.compile(r"\$?\?([A-Za-z_][^\s:]*)(?::.*)?\Z")
_GLOBAL = re.compile(r"\?\*.+\*\Z")

OBJECT = "object"
"""The head of patterns of instances."""


def find_variables(nodes: tuple[SyntaxNode, ...]) -> frozenset[str]:
    """Return the names of the local variables in nodes, e.g. ``x`` for ``?x`` and ``$?x``."""
    matches = (
        _VARIABLE.match(node.text) for top_node in nodes for node in top_node.walk() if node.items is None
    )
    return frozenset(match[1] for match in matches if match)


@dataclass(frozen=True, slots=True)
class FieldConstraint:
    """The constraint of one field of a pattern.

    :param binder: the variable or wildcard at the start of the field, as written: ``?x``, ``$?x``, ``?``,
        ``$?``; empty without one. CLIPS binds the variable, or compares the field with its value if it is
        bound before.
    :param alternatives: the parts joined by ``|``, each with the terms joined by ``&``. A term is one or more
        nodes.
    :param text: the source text on one line.
    """

    binder: str
    alternatives: tuple[tuple[tuple[SyntaxNode, ...], ...], ...]
    text: str

    @property
    def variable_name(self) -> str:
        """The name of the variable in :attr:`binder`; empty for a wildcard or without a binder."""
        match = _VARIABLE.match(self.binder)
        return match[1] if match else ""

    @property
    def wildcard(self) -> str:
        """The wildcard for the field: one value or several."""
        return "$?" if self.binder.startswith("$") else "?"

    @property
    def words(self) -> frozenset[str] | None:
        """The words that the field allows; None if it also allows other values."""
        # Several terms, a variable or a function allow values that are not in the text.
        literals = [
            literal(terms[0][0]) if len(terms) == len(terms[0]) == 1 else "" for terms in self.alternatives
        ]
        return frozenset(literals) if literals and all(literals) else None

    @property
    def used_variables(self) -> frozenset[str]:
        """The variables in the terms, which exclude the binder."""
        return frozenset().union(*(find_variables(term) for terms in self.alternatives for term in terms))


@dataclass(frozen=True, slots=True)
class SlotConstraint:
    """The constraints of a slot, or of a field of an ordered fact.

    :param slot: the name of the slot; empty for an ordered fact.
    :param position: the position of the field in an ordered fact, from 0; 0 for a slot.
    """

    slot: str
    position: int
    fields: tuple[FieldConstraint, ...]

    @property
    def label(self) -> str:
        """The name for users: ``mode``, ``field 2``."""
        return self.slot or f"field {self.position + 1}"

    @property
    def text(self) -> str:
        """The constraint on one line."""
        return " ".join(field.text for field in self.fields)

    @property
    def words(self) -> frozenset[str] | None:
        """The words that a single field allows; None for several fields, or if it allows other values."""
        return self.fields[0].words if len(self.fields) == 1 else None

    @property
    def bound_variables(self) -> frozenset[str]:
        """The variables at the starts of fields."""
        return frozenset(field.variable_name for field in self.fields if field.variable_name)

    @property
    def used_variables(self) -> frozenset[str]:
        """The variables in the terms of the fields."""
        return frozenset().union(*(field.used_variables for field in self.fields))

    def is_open(self, bound: frozenset[str]) -> bool:
        """Return whether each value satisfies the constraints.

        :param bound: the variables with a value before the slot.
        """
        # A variable restricts a field if it has a value before, or occurs twice in the slot.
        return all(field.binder and not field.alternatives for field in self.fields) and not (
            self.bound_variables & bound
            or len(self.bound_variables) < sum(bool(field.variable_name) for field in self.fields)
        )

    def join_fields(self, fields: list[str]) -> str:
        """Return fields as the text of the slot, or as fields of an ordered fact.

        :param fields: the texts of the fields.
        """
        return f"({self.slot} {' '.join(fields)})" if self.slot else " ".join(fields)


class PatternCE(Struct, frozen=True, dict=True):
    """A conditional element that matches one fact.

    :param node: the pattern in the source text.
    :param variable: the variable of the fact without ``?``, or empty.
    """

    node: SyntaxNode
    variable: str = ""

    @property
    def template(self) -> str:
        """The name of the deftemplate; ``object`` for a pattern of instances."""
        return self.node.head

    @cached_property
    def text(self) -> str:
        """The CE on one line."""
        text = compact(self.node.text)
        return f"?{self.variable} <- {text}" if self.variable else text

    @cached_property
    def is_ordered(self) -> bool:
        """Whether the pattern has fields instead of slots; an empty pattern counts as ordered."""
        arguments = self.node.arguments
        return not arguments or any(item.items is None for item in arguments)

    @cached_property
    def constraints(self) -> tuple[SlotConstraint, ...]:
        """The constraints of the slots, or of the fields of an ordered fact."""
        arguments = self.node.arguments
        if self.is_ordered:
            return tuple(
                SlotConstraint("", position, (field,))
                for position, field in enumerate(parse_field_constraints(arguments))
            )
        return tuple(
            SlotConstraint(item.head, 0, tuple(parse_field_constraints(item.arguments))) for item in arguments
        )

    @property
    def words_by_slot(self) -> dict[str, frozenset[str]]:
        """The allowed words by slot, without the slots that allow other values."""
        return {
            constraint.slot: words
            for constraint in self.constraints
            if constraint.slot and (words := constraint.words) is not None
        }

    @property
    def field_counts(self) -> tuple[int, float]:
        """The minimum and maximum number of fields of an ordered pattern; a ``$?`` allows infinitely many."""
        multifields = sum(constraint.fields[0].binder.startswith("$") for constraint in self.constraints)
        minimum = len(self.constraints) - multifields
        return minimum, inf if multifields else minimum

    @property
    def bound_variables(self) -> frozenset[str]:
        """The variables at the starts of fields."""
        return frozenset().union(*(constraint.bound_variables for constraint in self.constraints))

    def find_restrictive_constraints(self, bound: frozenset[str]) -> list[SlotConstraint]:
        """Return the constraints that some values do not satisfy.

        :param bound: the variables with a value before the pattern.
        """
        restrictive_constraints = []
        for constraint in self.constraints:
            restrictive_constraints += [] if constraint.is_open(bound) else [constraint]
            bound |= constraint.bound_variables
        return restrictive_constraints

    def text_without_variable(self) -> str:
        """Return the text without the variable of the fact."""
        return self.text.split("<-", 1)[1].strip() if self.variable else self.text

    def restricted_text(self, kept_constraint: SlotConstraint, foreign_variables: frozenset[str]) -> str:
        """Return the pattern with a single constraint, and with the bindings that the constraint needs.

        :param kept_constraint: the constraint to keep, one of :attr:`constraints`.
        :param foreign_variables: the variables that earlier CEs bind.
        """
        kept_variables = kept_constraint.used_variables | kept_constraint.bound_variables
        required_variables = kept_variables - foreign_variables
        earlier_constraints = self.constraints[: self.constraints.index(kept_constraint)]
        texts = []
        for constraint in self.constraints:
            if constraint is kept_constraint:
                texts.append(constraint.join_fields([field.text for field in constraint.fields]))
            # Slots can be omitted, but the fields of an ordered fact must stay at their positions.
            elif not constraint.slot or (
                constraint in earlier_constraints and constraint.bound_variables & required_variables
            ):
                bound_variables = required_variables if constraint in earlier_constraints else frozenset()
                texts.append(
                    constraint.join_fields(
                        [
                            field.binder if field.variable_name in bound_variables else field.wildcard
                            for field in constraint.fields
                        ]
                    )
                )
        return f"({' '.join([self.template, *texts])})"


class TestCE(Struct, frozen=True, dict=True):
    """A conditional element ``(test EXPRESSION)``."""

    node: SyntaxNode

    @cached_property
    def text(self) -> str:
        """The CE on one line."""
        return compact(self.node.text)

    @cached_property
    def used_variables(self) -> frozenset[str]:
        """The variables in the test."""
        return find_variables(self.node.arguments)


class GroupCE(Struct, frozen=True, dict=True):
    """A conditional element with inner CEs.

    :param kind: ``and``, ``or``, ``not``, ``exists`` or ``forall``.
    :param nodes: the nodes in the source text; several for an ``and`` without parentheses.
    """

    kind: str
    items: tuple[PatternCE | TestCE | GroupCE, ...]
    nodes: tuple[SyntaxNode, ...]

    @cached_property
    def text(self) -> str:
        """The CE on one line."""
        return compact(" ".join(node.text for node in self.nodes))


CE = PatternCE | TestCE | GroupCE
"""A conditional element."""


def find_patterns(ces: Sequence[CE]) -> Iterator[PatternCE]:
    """Yield all patterns, including those within groups."""
    for ce in ces:
        if isinstance(ce, PatternCE):
            yield ce
        elif isinstance(ce, GroupCE):
            yield from find_patterns(ce.items)


def find_needed_patterns(ces: Sequence[CE]) -> Iterator[PatternCE]:
    """Yield the patterns that must match a fact: those outside of ``not``, ``or`` and ``forall``."""
    for ce in ces:
        if isinstance(ce, PatternCE):
            yield ce
        elif isinstance(ce, GroupCE) and ce.kind == "exists":
            yield from find_needed_patterns(ce.items)


def split_rule(rule: SyntaxNode) -> tuple[Sequence[SyntaxNode], Sequence[SyntaxNode]]:
    """Return the nodes of a rule before its arrow, without its name, and those after it."""
    items = rule.arguments[1:]
    arrow = next((index for index, item in enumerate(items) if item.text == "=>"), len(items))
    return items[:arrow], items[arrow + 1 :]


def parse_condition(rule: SyntaxNode) -> tuple[CE, ...]:
    """Return the CEs of a rule, empty for other constructs."""
    return tuple(parse_elements(split_rule(rule)[0])) if rule.head == "defrule" else ()


def parse_elements(items: Sequence[SyntaxNode]) -> Iterator[CE]:
    """Yield the CEs of a list, without ``declare``; ``and`` and ``logical`` are flattened."""
    for nodes in _join_bindings(items):
        node = nodes[-1]
        # A text before the CEs is the doc-string, other words are mistakes, and `declare` has the salience.
        if node.items is None or node.head == "declare":
            continue
        if len(nodes) > 1:
            yield PatternCE(node, nodes[0].text.lstrip("$?"))
        elif node.head in ("and", "logical"):
            yield from parse_elements(node.arguments)
        elif node.head == "test":
            yield TestCE(node)
        elif node.head == "or":
            yield GroupCE("or", tuple(map(_parse_branch, _join_bindings(node.arguments))), (node,))
        elif node.head in ("not", "exists", "forall"):
            yield GroupCE(node.head, tuple(parse_elements(node.arguments)), (node,))
        else:
            yield PatternCE(node)


def _join_bindings(items: Sequence[SyntaxNode]) -> Iterator[Sequence[SyntaxNode]]:
    """Yield the nodes of each CE in a list: three for ``?f <- (...)``, else one."""
    index = 0
    while index < len(items):
        candidate = items[index : index + 3]
        has_arrow = len(candidate) == 3 and candidate[1].text == "<-"  # noqa: PLR2004 - variable, arrow, pattern
        length = 3 if has_arrow and candidate[0].items is None and candidate[2].items is not None else 1
        yield items[index : index + length]
        index += length


def _parse_branch(nodes: Sequence[SyntaxNode]) -> CE:
    """Return a branch of an ``or``."""
    ces = tuple(parse_elements(nodes))
    return ces[0] if len(ces) == 1 else GroupCE("and", ces, tuple(nodes))


def parse_field_constraints(nodes: tuple[SyntaxNode, ...]) -> Iterator[FieldConstraint]:
    """Yield the constraint of each field of a slot or an ordered pattern.

    The signs ``& | ~ : =`` join nodes to one field.
    """
    field_nodes: list[SyntaxNode] = []
    is_connected = True
    for node in nodes:
        is_connective = node.text in ("&", "|")
        if field_nodes and not is_connective and not is_connected:
            yield _make_field_constraint(field_nodes)
            field_nodes = []
        field_nodes.append(node)
        is_connected = is_connective or node.text in ("~", ":", "=")
    if field_nodes:
        yield _make_field_constraint(field_nodes)


def _make_field_constraint(nodes: list[SyntaxNode]) -> FieldConstraint:
    """Return the constraint that the nodes of a field express."""
    text = compact("".join(node.text for node in nodes))
    first_text, *next_texts = (node.text for node in nodes[:2])
    is_variable = first_text.startswith(("?", "$?")) and not _GLOBAL.match(first_text)
    # `?x|red` does not bind ?x, but compares the field with its value.
    binder = first_text if is_variable and next_texts != ["|"] else ""
    # The binder and the `&` after it do not restrict the field.
    constraint_nodes = nodes[2:] if binder else nodes
    alternatives = tuple(
        tuple(_split_at_mark("&", alternative)) for alternative in _split_at_mark("|", constraint_nodes)
    )
    return FieldConstraint(binder, tuple(filter(None, alternatives)), text)


def _split_at_mark(mark: str, nodes: Iterable[SyntaxNode]) -> Iterator[tuple[SyntaxNode, ...]]:
    """Yield the nodes between the occurrences of a mark."""
    groups = groupby(nodes, lambda node: node.text == mark)
    return (tuple(group) for is_mark, group in groups if not is_mark)
