"""The facts that an agent's constructs match and assert, and the words in the constructs.

The checks compare the two: a pattern without a fact never matches, and a fact without a pattern is useless.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, literal, read, without_module
from cxbridge.suggestions import nearest
from cxbridge_studio.agent.condition import CE, OBJECT, PatternCE, condition_of, needed, sides
from cxbridge_studio.agent.model import AgentModel
from cxbridge_studio.agent.names import Name, NameKind, PlacedPiece, SourceFile, Use
from cxbridge_studio.check.findings import SourcePlace

_WORD: Final = re.compile(r"[^\s()\"&|~;?$]+")
_FACT_IN_TEXT: Final = re.compile(r"\(\s*([A-Za-z][\w:/-]*)")
_MISSPELT: Final = 0.93  # similarity above which a name is taken for a misspelling of another name
# Functions that compare values, so that their words may select a goal class or a sub-type.
_COMPARISONS: Final = frozenset({"eq", "member$", "switch", "case", "create$"})

# Templates of facts that cxbridge or its features assert.
OF_PROGRAM: Final = re.compile(
    r"(init|time|startup|confval|plan|plan-action|plugin-status|acquire-control)"
    r"|(executive|ff-feature|domain|pddl|grounded|protobuf|navgraph|robmem|mutex|blackboard|skill|ros2?)-?.*"
)

Slots = Mapping[str, frozenset[str]]  # the possible words by slot; a slot that is missing can have any word


@dataclass(frozen=True, slots=True)
class FactUse:
    """A pattern of a rule, or an asserted fact.

    :param start: the offset in the construct.
    :param slots: the words that a pattern allows, or the literal words of a fact.
    :param slot_names: the slots that the text names, with literal or computed values.
    :param count: the minimum and the maximum number of fields; None for a pattern with slots.
    """

    template: str
    start: int
    slots: Slots
    slot_names: frozenset[str]
    count: tuple[int, float] | None = None

    def fits(self, fact: FactUse, defaults: Mapping[str, str]) -> bool:
        """Return whether this pattern can match an asserted fact.

        :param defaults: the default words of slots that the fact may omit; other omitted slots match any
            word.
        """
        for slot, words in self.slots.items():
            fact_words = fact.slots.get(slot)
            if fact_words is None and slot not in fact.slot_names and slot in defaults:
                fact_words = frozenset({defaults[slot]})
            if fact_words is not None and not fact_words & words:
                return False
        return True


@dataclass(frozen=True)
class Construct:
    """A construct, or a command of a batch file."""

    file: SourceFile
    placed: PlacedPiece

    @property
    def keyword(self) -> str:
        return self.placed.piece.keyword

    @property
    def name(self) -> str:
        """The name that the construct defines; empty if the construct defines none."""
        name = self.placed.piece.name
        return "" if name is None else name.text

    @property
    def module(self) -> str:
        """The module that the construct names or defines; empty if the construct names none."""
        is_construct = self.keyword.startswith("def") and self.node.arguments
        written = self.node.arguments[0].text if is_construct else ""
        return written if self.keyword == "defmodule" else written.rpartition("::")[0]

    def place(self, offset: int = 0) -> SourcePlace:
        """Return the position of an offset in the construct."""
        return SourcePlace.at(self.file.path, self.file.lines, self.placed.start + offset)

    @cached_property
    def node(self) -> SyntaxNode:
        """The parsed construct, with offsets in the construct; unclosed lists end with the text."""
        return read(self.placed.piece.text, close=True)[0]

    @cached_property
    def action_nodes(self) -> tuple[SyntaxNode, ...]:
        """All nodes in :attr:`actions`."""
        return tuple(node for action in self.actions for node in action.walk())

    @cached_property
    def patterns(self) -> tuple[FactUse, ...]:
        """The patterns that must match a fact, without patterns below ``not``."""
        return tuple(_pattern(ce) for ce in needed(self.condition) if ce.template != OBJECT)

    @cached_property
    def condition(self) -> tuple[CE, ...]:
        return condition_of(self.node)

    @cached_property
    def actions(self) -> tuple[SyntaxNode, ...]:
        """The right-hand side of a rule, the body of another construct, or the command itself.

        In an unclosed construct, the sides are unknown: all its nodes are actions.
        """
        items = self.node.arguments
        if not self.placed.piece.closed:
            return items
        if self.keyword == "defrule":
            return tuple(sides(self.node)[1])
        return items[1:] if self.keyword.startswith("def") else (self.node,)

    @cached_property
    def facts(self) -> tuple[FactUse, ...]:
        """The literal facts that the construct asserts."""
        nodes: list[SyntaxNode] = list(self.actions) if self.keyword == "deffacts" else []
        nodes += [fact for node in self.action_nodes if node.head == "assert" for fact in node.arguments]
        single_valued = self._single_valued_variables()
        return tuple(_fact(node, single_valued) for node in nodes if node.head)

    def _single_valued_variables(self) -> frozenset[str]:
        """Return the single-valued variables in the condition of a rule, written as ``?x``."""
        if self.keyword != "defrule":
            return frozenset()
        words = [node.text for node in self.node.walk() if node.items is None]
        condition_words = set(words[: words.index("=>")] if "=>" in words else ())
        # A variable that an action binds to another value may hold a multifield.
        rebound = {
            node.arguments[0].text for node in self.node.walk() if node.head == "bind" and node.arguments
        }
        return frozenset(
            word
            for word in condition_words - rebound
            if word.startswith("?") and f"${word}" not in condition_words
        )

    @cached_property
    def symbols(self) -> frozenset[str]:
        """The words and strings in the commands."""
        return frozenset(literal(node) for node in self.action_nodes if node.items is None)

    @cached_property
    def compared(self) -> frozenset[str]:
        """The words in comparisons, which may be in conditions, actions or queries."""
        return frozenset(
            literal(value)
            for node in self.node.walk()
            if node.head in _COMPARISONS
            for value in node.arguments
        )

    def sets_mode(self, mode: str) -> bool:
        """Return whether the construct may set a goal to this mode, or to a computed mode."""
        return any(
            node.head == "mode" and any(literal(value) in (mode, "") for value in node.arguments)
            for node in self.action_nodes
        )

    @cached_property
    def words(self) -> frozenset[str]:
        """All words in the commands, including the words within strings."""
        return frozenset(
            word for node in self.action_nodes if node.items is None for word in _WORD.findall(node.text)
        )


def constructs_of(file: SourceFile) -> tuple[Construct, ...]:
    """Return the constructs and commands of a file, without lists that begin with no word."""
    return tuple(Construct(file, placed) for placed in file.pieces if placed.piece.keyword)


def _pattern(ce: PatternCE) -> FactUse:
    slot_names = frozenset(constraint.slot for constraint in ce.parts if constraint.slot)
    count = ce.count if ce.is_ordered else None
    return FactUse(without_module(ce.template), ce.node.start, ce.slots, slot_names, count)


def _fact(node: SyntaxNode, single_valued: frozenset[str]) -> FactUse:
    """Return an asserted fact.

    :param single_valued: the variables that hold a single value, written as ``?x``.
    """
    slots = [item for item in node.arguments if item.head]
    words = {
        slot.head: frozenset({literal(slot.arguments[0])})
        for slot in slots
        if len(slot.arguments) == 1 and literal(slot.arguments[0])
    }
    minimum = sum(bool(literal(item)) or item.text in single_valued for item in node.arguments)
    # A call, or a variable that may hold a multifield, gives any number of fields.
    count = (minimum, minimum if minimum == len(node.arguments) else inf)
    slot_names = frozenset(slot.head for slot in slots)
    return FactUse(without_module(node.head), node.start, words, slot_names, count)


@dataclass
class Usage:
    """All facts that an agent's files match and assert.

    :param configured_words: the words in the configuration, which rules may read.
    :param deftemplates: the names of the deftemplates with slots in CLIPS.
    :param core_templates: the templates that files of the core name.
    :param constructs: the constructs of all files, in the order of loading.
    """

    model: AgentModel
    configured_words: frozenset[str] = frozenset()
    deftemplates: frozenset[str] = frozenset()
    core_templates: frozenset[str] = frozenset()
    constructs: tuple[Construct, ...] = ()

    @cached_property
    def asserted(self) -> dict[str, list[tuple[Construct, FactUse]]]:
        """The asserted facts by template, with their constructs."""
        asserted: dict[str, list[tuple[Construct, FactUse]]] = {}
        for construct in self.constructs:
            for fact in construct.facts:
                asserted.setdefault(fact.template, []).append((construct, fact))
        return asserted

    @cached_property
    def templates_in_texts(self) -> frozenset[str]:
        """The words after a parenthesis in strings: ``assert-string`` or ``eval`` may assert such facts."""
        return frozenset(
            word
            for construct in self.constructs
            for node in construct.action_nodes
            if node.text.startswith('"')
            for word in _FACT_IN_TEXT.findall(node.text)
        )

    @cached_property
    def symbols(self) -> Counter[str]:
        """The number of constructs with actions that contain a word, by word."""
        return Counter(word for construct in self.constructs for word in construct.symbols)

    def is_duplicated(self, template: str) -> bool:
        """Return whether a rule that matches a template duplicates a fact, which asserts a fact, too."""
        return any(
            node.head == "duplicate"
            for construct in self.constructs
            if template in {pattern.template for pattern in construct.patterns}
            for node in construct.action_nodes
        )

    def is_made_elsewhere(self, template: str) -> bool:
        """Return whether anything but literal assertions in the files may assert facts of a template."""
        if template in self.templates_in_texts or self._is_of_program(template) or self._loads_facts:
            return True
        is_defined = self.model.is_defined(Name(NameKind.TEMPLATE, template))
        # A template with slots that no file defines belongs to an interface or a feature.
        return (not is_defined and template in self.deftemplates) or self.is_duplicated(template)

    @cached_property
    def _loads_facts(self) -> bool:
        """Whether facts are loaded from files that the check does not read."""
        functions = self.model.names(NameKind.FUNCTION, Use.CALLED)
        return not functions.isdisjoint(("load-facts", "bload-facts", "bload"))

    def _is_of_program(self, template: str) -> bool:
        """Return whether cxbridge may assert facts of a template, unless the name is a likely misspelling."""
        if not OF_PROGRAM.fullmatch(template):
            return False
        # OF_PROGRAM matches prefixes: (skill-statu ...) is a misspelling, not a fact of cxbridge.
        known = self.core_templates | self.asserted.keys()
        return template in self.core_templates or not nearest(template, known, _MISSPELT)
