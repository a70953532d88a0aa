"""The condition of a rule: its conditional elements (CEs), and the constraints of its patterns."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf

from msgspec import Struct

from cxbridge.clipstext.syntax import SyntaxNode, literal, one_line

# a local variable; in CLIPS 6.4 a slot may follow, as in `?fact:slot`
_VARIABLE = re.compile(r"\$?\?([A-Za-z_][^\s:]*)(?::.*)?\Z")
_GLOBAL = re.compile(r"\?\*.+\*\Z")

OBJECT = "object"
"""The head of patterns of instances."""


def variables(nodes: tuple[SyntaxNode, ...]) -> frozenset[str]:
    """Return the names of the local variables in nodes, e.g. ``x`` for ``?x`` and ``$?x``."""
    matches = (
        _VARIABLE.match(node.text) for top_node in nodes for node in top_node.walk() if node.items is None
    )
    return frozenset(match[1] for match in matches if match)


@dataclass(frozen=True, slots=True)
class FieldConstraint:
    """The constraint of one field of a pattern.

    :param binder: the bound or repeated variable as written (``?x``, ``$?x``), or ``?``, ``$?`` or empty.
    :param alternatives: the parts joined by ``|``, each with the terms joined by ``&``, which are nodes.
    :param text: the source text on one line.
    """

    binder: str
    alternatives: tuple[tuple[tuple[SyntaxNode, ...], ...], ...]
    text: str

    @property
    def name(self) -> str:
        """The name of the bound or repeated variable, or empty."""
        match = _VARIABLE.match(self.binder)
        return match[1] if match else ""

    @property
    def wildcard(self) -> str:
        """The wildcard for the field: one value or several."""
        return "$?" if self.binder.startswith("$") else "?"

    @property
    def words(self) -> frozenset[str] | None:
        """The words that the field allows; None if it allows more than words."""
        # several terms, a variable or a function allow values that are not in the text
        literals = [
            literal(terms[0][0]) if len(terms) == len(terms[0]) == 1 else "" for terms in self.alternatives
        ]
        return frozenset(literals) if literals and all(literals) else None

    @property
    def used(self) -> frozenset[str]:
        """The variables of the terms, without the binder."""
        return frozenset().union(*(variables(term) for terms in self.alternatives for term in terms))

    def loosened(self, bound: frozenset[str], *, bind: bool) -> str:
        """Return the text with only those terms whose variables are known.

        :param bound: variables with a value.
        :param bind: whether to keep the binder.
        """
        # a term whose variables have no value cannot be tested: without it the field matches more facts
        head = self.binder if bind and self.name else self.wildcard
        usable = [
            [term for term in terms if variables(term) <= bound | ({self.name} if bind else set())]
            for terms in self.alternatives
        ]
        # an alternative without terms allows any value, and with it the whole field
        if not all(usable) or not usable:
            return head
        tests = "|".join("&".join("".join(node.text for node in term) for term in terms) for terms in usable)
        return f"{head}&{tests}" if head not in ("?", "$?") else tests


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
        """The words that a single field allows; None if it allows more than words, or there are several."""
        return self.fields[0].words if len(self.fields) == 1 else None

    @property
    def binds(self) -> frozenset[str]:
        """The variables at the starts of fields."""
        return frozenset(field.name for field in self.fields if field.name)

    @property
    def used(self) -> frozenset[str]:
        """The variables in the tests."""
        return frozenset().union(*(field.used for field in self.fields))

    def is_open(self, bound: frozenset[str]) -> bool:
        """Return whether any value satisfies the constraints.

        :param bound: the variables with an earlier value.
        """
        # a variable restricts the field if it has a value, or occurs twice in the slot
        return all(field.binder and not field.alternatives for field in self.fields) and not (
            self.binds & bound or len(self.binds) < sum(bool(field.name) for field in self.fields)
        )

    def write(self, fields: list[str]) -> str:
        """Return the constraints as a part of a pattern.

        :param fields: the texts of the fields.
        """
        return f"({self.slot} {' '.join(fields)})" if self.slot else " ".join(fields)


class PatternCE(Struct, frozen=True, dict=True):
    """A pattern CE.

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
        text = one_line(self.node.text)
        return f"?{self.variable} <- {text}" if self.variable else text

    @cached_property
    def is_ordered(self) -> bool:
        """Whether the pattern has fields instead of slots; an empty pattern counts as ordered."""
        arguments = self.node.arguments
        return not arguments or any(item.items is None for item in arguments)

    @cached_property
    def parts(self) -> tuple[SlotConstraint, ...]:
        """The constraints of each slot, or of each field of an ordered fact."""
        arguments = self.node.arguments
        if self.is_ordered:
            return tuple(
                SlotConstraint("", position, (field,)) for position, field in enumerate(fields_of(arguments))
            )
        return tuple(SlotConstraint(item.head, 0, tuple(fields_of(item.arguments))) for item in arguments)

    @property
    def slots(self) -> dict[str, frozenset[str]]:
        """The allowed words by slot, for slots restricted to words."""
        return {part.slot: words for part in self.parts if part.slot and (words := part.words) is not None}

    @property
    def count(self) -> tuple[int, float]:
        """The minimum and maximum number of fields of an ordered pattern."""
        multifields = sum(part.fields[0].binder.startswith("$") for part in self.parts)
        minimum = len(self.parts) - multifields
        return minimum, inf if multifields else minimum

    @property
    def binds(self) -> frozenset[str]:
        """The variables at the starts of fields."""
        return frozenset().union(*(part.binds for part in self.parts))

    def restrictive_parts(self, bound: frozenset[str]) -> list[SlotConstraint]:
        """Return the parts that not every value satisfies.

        :param bound: the variables with a value before the pattern.
        """
        restrictive_parts = []
        for part in self.parts:
            if not part.is_open(bound):
                restrictive_parts.append(part)
            bound |= part.binds
        return restrictive_parts

    def bare(self) -> str:
        """Return the text without the variable of the fact."""
        return self.text.split("<-", 1)[1].strip() if self.variable else self.text

    def alone(self, foreign: frozenset[str]) -> str:
        """Return the pattern without constraints on variables of earlier CEs.

        :param foreign: the variables that earlier CEs bind.
        """
        bound: set[str] = set()
        texts = []
        for part in self.parts:
            fields = []
            for field in part.fields:
                is_own = field.name not in foreign
                if is_own and field.name:
                    bound.add(field.name)
                fields.append(field.loosened(frozenset(bound), bind=is_own))
            texts.append(part.write(fields))
        return f"({' '.join([self.template, *texts])})"

    def only(self, selected: SlotConstraint, foreign: frozenset[str]) -> str:
        """Return the pattern with only one part and the bindings that it needs.

        :param foreign: the variables that earlier CEs bind.
        """
        required = (selected.used | selected.binds) - foreign
        texts = []
        precedes = True
        for part in self.parts:
            if part is selected:
                precedes = False
                texts.append(part.write([field.text for field in part.fields]))
            elif precedes and part.binds & required:
                fields = [f.binder if f.name in required else f.wildcard for f in part.fields]
                texts.append(part.write(fields))
            # the fields of an ordered fact stand at their positions, slots can be left out
            elif not part.slot:
                texts.append(part.write([field.wildcard for field in part.fields]))
        return f"({' '.join([self.template, *texts])})"


class TestCE(Struct, frozen=True, dict=True):
    """A test CE."""

    node: SyntaxNode

    @cached_property
    def text(self) -> str:
        """The CE on one line."""
        return one_line(self.node.text)

    @cached_property
    def used(self) -> frozenset[str]:
        """The variables in the test."""
        return variables(self.node.arguments)


class GroupCE(Struct, frozen=True, dict=True):
    """CEs in one of ``and or not exists forall``.

    :param nodes: the nodes in the source text.
    """

    kind: str
    items: tuple[PatternCE | TestCE | GroupCE, ...]
    nodes: tuple[SyntaxNode, ...]

    @cached_property
    def text(self) -> str:
        """The CE on one line."""
        return one_line(" ".join(node.text for node in self.nodes))


CE = PatternCE | TestCE | GroupCE
"""A conditional element."""


def patterns(ces: Sequence[CE]) -> Iterator[PatternCE]:
    """Yield all patterns, including those within groups."""
    for ce in ces:
        if isinstance(ce, PatternCE):
            yield ce
        elif isinstance(ce, GroupCE):
            yield from patterns(ce.items)


def needed(ces: Sequence[CE]) -> Iterator[PatternCE]:
    """Yield the patterns that must match a fact, which are not within ``not``, ``or`` or ``forall``."""
    for ce in ces:
        if isinstance(ce, PatternCE):
            yield ce
        elif isinstance(ce, GroupCE) and ce.kind == "exists":
            yield from needed(ce.items)


def sides(rule: SyntaxNode) -> tuple[Sequence[SyntaxNode], Sequence[SyntaxNode]]:
    """Return the nodes of a rule before its arrow, without its name, and those after it."""
    items = rule.arguments[1:]
    arrow = next((index for index, item in enumerate(items) if item.text == "=>"), len(items))
    return items[:arrow], items[arrow + 1 :]


def condition_of(rule: SyntaxNode) -> tuple[CE, ...]:
    """Return the CEs of a rule, empty for other constructs."""
    return tuple(elements(sides(rule)[0])) if rule.head == "defrule" else ()


def elements(items: Sequence[SyntaxNode]) -> Iterator[CE]:
    """Yield the CEs of a list, without ``declare`` and with ``and`` and ``logical`` flattened."""
    for nodes in _joined_bindings(items):
        node = nodes[-1]
        # `?f`, `<-` and words between the CEs are not CEs, `declare` has the salience
        if node.items is None or node.head == "declare":
            continue
        if len(nodes) > 1:
            yield PatternCE(node, nodes[0].text.lstrip("$?"))
        elif node.head in ("and", "logical"):
            yield from elements(node.arguments)
        elif node.head == "test":
            yield TestCE(node)
        elif node.head == "or":
            yield GroupCE("or", tuple(map(_branch, _joined_bindings(node.arguments))), (node,))
        elif node.head in ("not", "exists", "forall"):
            yield GroupCE(node.head, tuple(elements(node.arguments)), (node,))
        else:
            yield PatternCE(node)


def _joined_bindings(items: Sequence[SyntaxNode]) -> Iterator[Sequence[SyntaxNode]]:
    """Yield the elements of a list of CEs, with ``?f <- (...)`` as one."""
    index = 0
    while index < len(items):
        binding = items[index : index + 3]
        binds = len(binding) == 3 and binding[1].text == "<-"  # noqa: PLR2004 - variable, arrow, pattern
        length = 3 if binds and binding[0].items is None and binding[2].items is not None else 1
        yield items[index : index + length]
        index += length


def _branch(nodes: Sequence[SyntaxNode]) -> CE:
    ces = tuple(elements(nodes))
    return ces[0] if len(ces) == 1 else GroupCE("and", ces, tuple(nodes))


def fields_of(nodes: tuple[SyntaxNode, ...]) -> Iterator[FieldConstraint]:
    """Yield the fields of a slot or an ordered pattern; ``& | ~ : =`` connect nodes."""
    group: list[SyntaxNode] = []
    is_connected = True
    for node in nodes:
        is_connective = node.text in ("&", "|")
        if group and not is_connective and not is_connected:
            yield _field(group)
            group = []
        group.append(node)
        is_connected = is_connective or node.text in ("~", ":", "=")
    if group:
        yield _field(group)


def _field(nodes: list[SyntaxNode]) -> FieldConstraint:
    text = one_line("".join(node.text for node in nodes))
    first = nodes[0].text
    binder = first if first.startswith(("?", "$?")) and not _GLOBAL.match(first) else ""
    # `?x|red` tests ?x, it does not bind it
    if binder and len(nodes) > 1 and nodes[1].text == "|":
        binder = ""
    # the binder and the `&` after it are no constraint
    constraint_nodes = nodes[2:] if binder else nodes
    alternatives: list[list[list[SyntaxNode]]] = [[[]]]
    for node in constraint_nodes:
        if node.text == "|":
            alternatives.append([[]])
        elif node.text == "&":
            alternatives[-1].append([])
        else:
            alternatives[-1][-1].append(node)
    terms_by_alternative = tuple(tuple(tuple(term) for term in terms if term) for terms in alternatives)
    return FieldConstraint(binder, tuple(terms for terms in terms_by_alternative if terms), text)
