"""The uses of an agent's constructs: patterns with constraints, asserted facts, words."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Final

from cxbridge.clipstext.condition import CE, OBJECT, PatternCE, condition_of, needed, sides
from cxbridge.clipstext.syntax import SyntaxNode, literal, read, without_module
from cxbridge.suggestions import nearest
from cxbridge_studio.agent.model import AgentModel
from cxbridge_studio.agent.names import Name, NameKind, PlacedPiece, SourceFile, Use

_WORD: Final = re.compile(r"[^\s()\"&|~;?$]+")
_FACT_IN_TEXT: Final = re.compile(r"\(\s*([A-Za-z][\w:/-]*)")
_NEARLY: Final = 0.93  # similarity above which one name is taken as a misspelling of the other
_COMPARISONS: Final = frozenset({"eq", "member$", "switch", "case", "create$"})

# Templates of facts that the program or its features assert.
OF_PROGRAM: Final = re.compile(
    r"(init|time|startup|confval|plan|plan-action|plugin-status|acquire-control)"
    r"|(executive|ff-feature|domain|pddl|grounded|protobuf|navgraph|robmem|mutex|blackboard|skill|ros2?)-?.*"
)

Slots = Mapping[str, frozenset[str]]  # possible words by slot; a missing slot can have any word


@dataclass(frozen=True, slots=True)
class FactUse:
    """A pattern of a rule, or an asserted fact.

    :param start: offset in the piece.
    :param slots: the constraints of a pattern, or the literal words of a fact.
    :param named: the slots that are written.
    :param count: minimum and maximum number of fields if ordered; None for a pattern with slots.
    """

    template: str
    start: int
    slots: Slots
    named: frozenset[str]
    count: tuple[int, float] | None = None

    def fits(self, made: FactUse, defaults: Mapping[str, str]) -> bool:
        """Return whether this pattern can match an asserted fact.

        :param defaults: default words of slots that the fact may omit; other omitted slots match any word.
        """
        for slot, words in self.slots.items():
            have = made.slots.get(slot)
            if have is None and slot not in made.named and slot in defaults:
                have = frozenset({defaults[slot]})
            if have is not None and not have & words:
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
        """The defined name; empty if there is none."""
        name = self.placed.piece.name
        return "" if name is None else name.text

    @property
    def module(self) -> str:
        """The module that the construct names or defines; empty if it has none."""
        is_construct = self.keyword.startswith("def") and self.node.arguments
        written = self.node.arguments[0].text if is_construct else ""
        return written if self.keyword == "defmodule" else written.rpartition("::")[0]

    @cached_property
    def node(self) -> SyntaxNode:
        return read(self.placed.piece.text, close=True)[0]

    @cached_property
    def patterns(self) -> tuple[FactUse, ...]:
        """The patterns that must match a fact, without those below ``not``."""
        return tuple(_pattern(ce) for ce in needed(self.condition) if ce.template != OBJECT)

    @cached_property
    def condition(self) -> tuple[CE, ...]:
        return condition_of(self.node)

    @cached_property
    def actions(self) -> tuple[SyntaxNode, ...]:
        """The right-hand side of a rule, the body of another construct, or all of an unclosed construct."""
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
        for action in self.actions:
            nodes += (fact for node in action.walk() if node.head == "assert" for fact in node.arguments)
        single = self._single
        return tuple(_fact(node, single) for node in nodes if node.head)

    @cached_property
    def _single(self) -> frozenset[str]:
        """The single-valued variables in the condition of a rule, as ``?x``."""
        if self.keyword != "defrule":
            return frozenset()
        words = [node.text for node in self.node.walk() if node.items is None]
        condition_words = set(words[: words.index("=>")] if "=>" in words else ())
        bound = {
            node.arguments[0].text for node in self.node.walk() if node.head == "bind" and node.arguments
        }
        return frozenset(
            word
            for word in condition_words - bound
            if word.startswith("?") and f"${word}" not in condition_words
        )

    @cached_property
    def symbols(self) -> frozenset[str]:
        """The words and strings in the commands."""
        nodes = (node for action in self.actions for node in action.walk() if node.items is None)
        return frozenset(map(literal, nodes))

    @cached_property
    def compared(self) -> frozenset[str]:
        """The words in comparisons, in conditions, tests and queries."""
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
            for action in self.actions
            for node in action.walk()
        )

    @cached_property
    def words(self) -> frozenset[str]:
        """All words in the commands, including the words within strings."""
        return frozenset(
            word
            for action in self.actions
            for node in action.walk()
            if node.items is None
            for word in _WORD.findall(node.text)
        )


def constructs_of(file: SourceFile) -> tuple[Construct, ...]:
    return tuple(Construct(file, placed) for placed in file.pieces if placed.piece.keyword)


def _pattern(ce: PatternCE) -> FactUse:
    named = frozenset(part.slot for part in ce.parts if part.slot)
    count = ce.count if ce.is_ordered else None
    return FactUse(without_module(ce.template), ce.node.start, ce.slots, named, count)


def _fact(node: SyntaxNode, single: frozenset[str]) -> FactUse:
    """Return an asserted fact.

    :param single: the single-valued variables.
    """
    named = [item for item in node.arguments if item.head]
    slots = {
        item.head: frozenset({literal(item.arguments[0])})
        for item in named
        if len(item.arguments) == 1 and literal(item.arguments[0])
    }
    least = sum(bool(literal(item)) or item.text in single for item in node.arguments)
    count = (least, least if least == len(node.arguments) else inf)
    return FactUse(
        without_module(node.head), node.start, slots, frozenset(item.head for item in named), count
    )


@dataclass
class Usage:
    """All facts that an agent's files match and assert.

    :param others: words that reach rules from the configuration.
    :param deftemplates: CLIPS' deftemplates with slots.
    :param of_core: templates that files of the core name.
    :param constructs: the constructs of all files, in order.
    """

    model: AgentModel
    others: frozenset[str] = frozenset()
    deftemplates: frozenset[str] = frozenset()
    of_core: frozenset[str] = frozenset()
    constructs: tuple[Construct, ...] = ()

    @cached_property
    def made(self) -> dict[str, list[tuple[Construct, FactUse]]]:
        """The asserted facts by template, with their constructs."""
        makers: dict[str, list[tuple[Construct, FactUse]]] = {}
        for construct in self.constructs:
            for fact in construct.facts:
                makers.setdefault(fact.template, []).append((construct, fact))
        return makers

    @cached_property
    def templates_in_texts(self) -> frozenset[str]:
        """Words after a parenthesis in strings: ``assert-string`` or ``eval`` may assert such facts."""
        texts = (
            node.text
            for construct in self.constructs
            for action in construct.actions
            for node in action.walk()
            if node.text.startswith('"')
        )
        return frozenset(word for text in texts for word in _FACT_IN_TEXT.findall(text))

    @cached_property
    def symbols(self) -> Counter[str]:
        """The number of constructs whose commands contain a word."""
        return Counter(word for construct in self.constructs for word in construct.symbols)

    def is_duplicated(self, template: str) -> bool:
        """Return whether a rule duplicates a fact of a template, which asserts another fact."""
        return any(
            node.head == "duplicate"
            for construct in self.constructs
            if template in {pattern.template for pattern in construct.patterns}
            for action in construct.actions
            for node in action.walk()
        )

    def is_made_elsewhere(self, template: str) -> bool:
        """Return whether facts of a template may come from elsewhere than assertions in the files."""
        if template in self.templates_in_texts or self._is_of_program(template) or self._loads_facts:
            return True
        is_defined = self.model.is_defined(Name(NameKind.TEMPLATE, template))
        # A template with slots that no file defines belongs to an interface or a feature.
        return (not is_defined and template in self.deftemplates) or self.is_duplicated(template)

    @cached_property
    def _loads_facts(self) -> bool:
        """Whether facts are loaded from files that the check does not read."""
        called = self.model.names(NameKind.FUNCTION, Use.CALLED)
        return not called.isdisjoint(("load-facts", "bload-facts", "bload"))

    def _is_of_program(self, template: str) -> bool:
        """Return whether the program may assert a template, unless the name resembles a known template."""
        if not OF_PROGRAM.fullmatch(template) or template in self.of_core:
            return bool(OF_PROGRAM.fullmatch(template))
        return not nearest(template, self.of_core | self.made.keys(), _NEARLY)

    def find(self, file: str, keyword: str, name: str) -> Construct | None:
        matches = [
            each
            for each in self.constructs
            if (each.file.path, each.keyword, each.name) == (file, keyword, name)
        ]
        return matches[-1] if matches else None

    def read_templates(self) -> set[str]:
        """Return the templates in patterns and queries."""
        return self.model.names(NameKind.TEMPLATE, Use.MATCHED, Use.QUERIED)
