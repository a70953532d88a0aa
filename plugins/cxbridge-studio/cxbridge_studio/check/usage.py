"""The facts that an agent's constructs match and assert, and the words in the constructs.

The checks compare patterns and asserted facts: a pattern without a fact never matches, and a fact without a
pattern is useless.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, literal, read_nodes, without_module
from cxbridge.suggestions import nearest_names
from cxbridge_studio.agent.condition import (
    CE,
    OBJECT,
    PatternCE,
    find_needed_patterns,
    parse_condition,
    split_rule,
)
from cxbridge_studio.agent.model import AgentModel
from cxbridge_studio.agent.names import Name, NameKind, PlacedPiece, SourceFile, Use
from cxbridge_studio.check.findings import SourcePlace

_WORD: Final = re.compile(r"[^\s()\"&|~;?$]+")
# The first word of a list in a string, such as the template in the argument of `assert-string`.
_LIST_HEAD_IN_STRING: Final = re.compile(r"\(\s*([A-Za-z][\w:/-]*)")
# The minimum similarity with which a name counts as misspelt. A name has this similarity if one of 15 letters
# is wrong, or one of 8 letters is missing.
_MIN_MISSPELT_LIKENESS: Final = 0.93
# Functions that compare values, or list values to compare: their words may select a goal class or a sub-type.
_COMPARISON_FUNCTIONS: Final = frozenset({"eq", "member$", "switch", "case", "create$"})

# Matches the templates whose facts cxbridge or its features assert, and templates with such a prefix.
PROGRAM_TEMPLATES: Final = re.compile(
    r"(init|time|startup|confval|plan|plan-action|plugin-status|acquire-control)"
    r"|(executive|ff-feature|domain|pddl|grounded|protobuf|navgraph|robmem|mutex|blackboard|skill|ros2?)-?.*"
)

# The possible words by slot. A slot that is not a key can have any word.
WordsBySlot = Mapping[str, frozenset[str]]


@dataclass(frozen=True, slots=True)
class FactUse:
    """A pattern of a rule, or an asserted fact.

    :param start: the offset in the construct.
    :param words_by_slot: the words that a pattern allows, or the literal words of a fact.
    :param slot_names: the slots that the text names, with literal or computed values.
    :param field_counts: the minimum and the maximum number of fields; None for a pattern with slots.
    """

    template: str
    start: int
    words_by_slot: WordsBySlot
    slot_names: frozenset[str]
    field_counts: tuple[int, float] | None = None

    def can_match(self, fact: FactUse, defaults: Mapping[str, str]) -> bool:
        """Return whether the slots of this pattern can match those of an asserted fact of its template.

        :param defaults: the default words of slots that the fact may omit. Other omitted slots can have any
            word.
        """
        for slot, words in self.words_by_slot.items():
            fact_words = fact.words_by_slot.get(slot)
            if fact_words is None and slot not in fact.slot_names and slot in defaults:
                fact_words = frozenset({defaults[slot]})
            if fact_words is not None and not fact_words & words:
                return False
        return True


@dataclass(frozen=True)
class Construct:
    """A construct, or a command of a batch file."""

    file: SourceFile
    placed_piece: PlacedPiece

    @property
    def keyword(self) -> str:
        return self.placed_piece.piece.keyword

    @property
    def name(self) -> str:
        """The name that the construct defines; empty if the construct defines none."""
        name = self.placed_piece.piece.name
        return "" if name is None else name.text

    @property
    def module(self) -> str:
        """The CLIPS module that the construct names or defines; empty if it names none."""
        is_construct = self.keyword.startswith("def") and self.node.arguments
        written_name = self.node.arguments[0].text if is_construct else ""
        return written_name if self.keyword == "defmodule" else written_name.rpartition("::")[0]

    def place(self, offset: int = 0) -> SourcePlace:
        """Return the position of an offset in the construct."""
        return SourcePlace.at(self.file.path, self.file.lines, self.placed_piece.start + offset)

    @cached_property
    def node(self) -> SyntaxNode:
        """The parsed construct, with offsets in the construct; unclosed lists end with the text."""
        return read_nodes(self.placed_piece.piece.text, close=True)[0]

    @cached_property
    def action_nodes(self) -> tuple[SyntaxNode, ...]:
        """All nodes in :attr:`actions`."""
        return tuple(node for action in self.actions for node in action.walk())

    @cached_property
    def patterns(self) -> tuple[FactUse, ...]:
        """The patterns that must match a fact, without patterns below ``not``."""
        return tuple(
            _make_pattern_use(ce) for ce in find_needed_patterns(self.condition) if ce.template != OBJECT
        )

    @cached_property
    def condition(self) -> tuple[CE, ...]:
        return parse_condition(self.node)

    @cached_property
    def actions(self) -> tuple[SyntaxNode, ...]:
        """The right-hand side of a rule, the body of another construct, or the command itself.

        The sides of an unclosed construct are unknown, so all its nodes count as actions.
        """
        items = self.node.arguments
        if not self.placed_piece.piece.is_closed:
            return items
        if self.keyword == "defrule":
            return tuple(split_rule(self.node)[1])
        return items[1:] if self.keyword.startswith("def") else (self.node,)

    @property
    def asserted_nodes(self) -> tuple[SyntaxNode, ...]:
        """The nodes of the facts that the construct asserts."""
        calls = (node for node in self.action_nodes if node.head == "assert")
        deffacts = self.actions if self.keyword == "deffacts" else ()
        return (*deffacts, *(fact for call in calls for fact in call.arguments))

    @cached_property
    def facts(self) -> tuple[FactUse, ...]:
        """The facts that the construct asserts, except facts with a computed template."""
        single_valued_variables = self._find_single_valued_variables()
        return tuple(
            _make_fact_use(node, single_valued_variables) for node in self.asserted_nodes if node.head
        )

    def _find_single_valued_variables(self) -> frozenset[str]:
        """Return the single-valued variables in the condition of a rule, written as ``?x``."""
        if self.keyword != "defrule":
            return frozenset()
        words = [node.text for node in self.node.walk() if node.items is None]
        condition_words = set(words[: words.index("=>")] if "=>" in words else ())
        # After an action has bound a variable again, the variable may hold a multifield.
        rebound_variables = {
            node.arguments[0].text for node in self.node.walk() if node.head == "bind" and node.arguments
        }
        return frozenset(
            word
            for word in condition_words - rebound_variables
            if word.startswith("?") and f"${word}" not in condition_words
        )

    @cached_property
    def action_literals(self) -> frozenset[str]:
        """The words and strings in the actions."""
        return frozenset(literal(node) for node in self.action_nodes if node.items is None)

    @cached_property
    def compared_words(self) -> frozenset[str]:
        """The words in comparisons, which may be in conditions, actions or queries."""
        return frozenset(
            literal(value)
            for node in self.node.walk()
            if node.head in _COMPARISON_FUNCTIONS
            for value in node.arguments
        )

    def sets_mode(self, mode: str) -> bool:
        """Return whether the construct may set a goal to this mode, or to a computed mode."""
        return any(
            node.head == "mode" and any(literal(value) in (mode, "") for value in node.arguments)
            for node in self.action_nodes
        )

    @cached_property
    def action_words(self) -> frozenset[str]:
        """The words in the actions, including the words within strings."""
        return frozenset(
            word for node in self.action_nodes if node.items is None for word in _WORD.findall(node.text)
        )


def make_constructs(file: SourceFile) -> tuple[Construct, ...]:
    """Return the constructs and commands of a file. Lists that do not begin with a word are neither."""
    return tuple(Construct(file, placed_piece) for placed_piece in file.pieces if placed_piece.piece.keyword)


def _make_pattern_use(ce: PatternCE) -> FactUse:
    """Return the use of facts by a pattern."""
    slot_names = frozenset(constraint.slot for constraint in ce.constraints if constraint.slot)
    field_counts = ce.field_counts if ce.is_ordered else None
    return FactUse(without_module(ce.template), ce.node.start, ce.words_by_slot, slot_names, field_counts)


def _make_fact_use(node: SyntaxNode, single_valued_variables: frozenset[str]) -> FactUse:
    """Return the use of a fact by an assertion.

    :param single_valued_variables: the variables that hold a single value, written as ``?x``.
    """
    slots = [item for item in node.arguments if item.head]
    words = {
        slot.head: frozenset({literal(slot.arguments[0])})
        for slot in slots
        if len(slot.arguments) == 1 and literal(slot.arguments[0])
    }
    minimum = sum(bool(literal(item)) or item.text in single_valued_variables for item in node.arguments)
    # A call, or a variable that may hold a multifield, may give any number of fields.
    field_counts = (minimum, minimum if minimum == len(node.arguments) else inf)
    slot_names = frozenset(slot.head for slot in slots)
    return FactUse(without_module(node.head), node.start, words, slot_names, field_counts)


@dataclass
class Usage:
    """All facts that an agent's constructs match and assert, and the words in the constructs.

    :param configured_words: the words in the configuration, which rules may read.
    :param deftemplates: the names of the deftemplates in CLIPS, except those of ordered facts.
    :param core_templates: the templates that files of the core name.
    :param constructs: the constructs of all files, in the order of loading.
    """

    model: AgentModel
    configured_words: frozenset[str] = frozenset()
    deftemplates: frozenset[str] = frozenset()
    core_templates: frozenset[str] = frozenset()
    constructs: tuple[Construct, ...] = ()

    @cached_property
    def asserted_facts(self) -> dict[str, list[tuple[Construct, FactUse]]]:
        """The asserted facts by template, with their constructs."""
        asserted_facts: dict[str, list[tuple[Construct, FactUse]]] = {}
        for construct in self.constructs:
            for fact in construct.facts:
                asserted_facts.setdefault(fact.template, []).append((construct, fact))
        return asserted_facts

    @cached_property
    def list_heads_in_strings(self) -> frozenset[str]:
        """The first words of lists in strings, which ``assert-string`` may assert, or ``eval`` may call."""
        return frozenset(
            word
            for construct in self.constructs
            for node in construct.action_nodes
            if node.text.startswith('"')
            for word in _LIST_HEAD_IN_STRING.findall(node.text)
        )

    @cached_property
    def literal_counts(self) -> Counter[str]:
        """By word, the number of constructs whose actions contain the word."""
        return Counter(word for construct in self.constructs for word in construct.action_literals)

    def is_duplicated(self, template: str) -> bool:
        """Return whether a rule that matches facts of a template duplicates a fact, perhaps one of them."""
        return any(
            node.head == "duplicate"
            for construct in self.constructs
            if template in {pattern.template for pattern in construct.patterns}
            for node in construct.action_nodes
        )

    def is_made_elsewhere(self, template: str) -> bool:
        """Return whether facts of a template may come from anything but literal assertions in the files."""
        if template in self.list_heads_in_strings or self._is_program_template(template) or self._loads_facts:
            return True
        is_defined = self.model.is_defined(Name(NameKind.TEMPLATE, template))
        # A deftemplate that no file defines belongs to an interface or a feature, which may assert the facts.
        return (not is_defined and template in self.deftemplates) or self.is_duplicated(template)

    @cached_property
    def _loads_facts(self) -> bool:
        """Whether the agent loads facts or binary constructs from files, which the check does not read."""
        functions = self.model.find_names(NameKind.FUNCTION, Use.CALLED)
        return not functions.isdisjoint(("load-facts", "bload-facts", "bload"))

    def _is_program_template(self, template: str) -> bool:
        """Return whether cxbridge may assert facts of a template, unless its name is a likely misspelling."""
        if not PROGRAM_TEMPLATES.fullmatch(template):
            return False
        # The expression matches prefixes, but (skill-statu ...) is a misspelling, not a fact of cxbridge.
        known_templates = self.core_templates | self.asserted_facts.keys()
        return template in self.core_templates or not nearest_names(
            template, known_templates, _MIN_MISSPELT_LIKENESS
        )
