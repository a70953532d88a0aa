"""The uses of an agent's constructs: patterns with their constraints, facts, words."""

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
_NEARLY: Final = 0.93
"""How alike two names are of which one is misspelt."""
_COMPARISONS: Final = frozenset({"eq", "member$", "switch", "case", "create$"})

OF_PROGRAM: Final = re.compile(
    r"(init|time|startup|confval|plan|plan-action|plugin-status|acquire-control)"
    r"|(executive|ff-feature|domain|pddl|grounded|protobuf|navgraph|robmem|mutex|blackboard|skill|ros2?)-?.*"
)
"""Templates of facts that the program makes, or a feature of it."""

Slots = Mapping[str, frozenset[str]]
"""The words that a slot can have; a slot that is not in it can have any."""


@dataclass(frozen=True, slots=True)
class FactUse:
    """A pattern of a rule, or a fact that is made.

    :param start: where it begins in its piece.
    :param slots: of a pattern, its constraints; of a fact, the one literal word.
    :param named: the slots that are written at all.
    :param count: the least and the greatest number of fields, if the pattern or the fact is ordered; None:
        a pattern with slots.
    """

    template: str
    start: int
    slots: Slots
    named: frozenset[str]
    count: tuple[int, float] | None = None

    def fits(self, made: FactUse, defaults: Mapping[str, str]) -> bool:
        """Whether this pattern can match a fact that is made so.

        :param defaults: of the slots that the fact may leave out; any word for the rest.
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
    """A construct, or a command of a batch file.

    :param patterns: those that must match a fact: none below ``not``.
    """

    file: SourceFile
    placed: PlacedPiece

    @property
    def keyword(self) -> str:
        """``defrule`` and its like."""
        return self.placed.piece.keyword

    @property
    def name(self) -> str:
        """Its name; empty when it has none."""
        name = self.placed.piece.name
        return "" if name is None else name.text

    @property
    def module(self) -> str:
        """The module that it names, or defines; empty when it does neither."""
        is_construct = self.keyword.startswith("def") and self.node.arguments
        written = self.node.arguments[0].text if is_construct else ""
        return written if self.keyword == "defmodule" else written.rpartition("::")[0]

    @cached_property
    def node(self) -> SyntaxNode:
        """Its text, read."""
        return read(self.placed.piece.text, close=True)[0]

    @cached_property
    def patterns(self) -> tuple[FactUse, ...]:
        """The patterns that a rule needs a fact for."""
        return tuple(_pattern(ce) for ce in needed(self.condition) if ce.template != OBJECT)

    @cached_property
    def condition(self) -> tuple[CE, ...]:
        """The condition of a rule; empty for anything else."""
        return condition_of(self.node)

    @cached_property
    def actions(self) -> tuple[SyntaxNode, ...]:
        """Its commands: of a rule the part behind the arrow, of any other or unclosed construct, all."""
        items = self.node.arguments
        if not self.placed.piece.closed:
            return items
        if self.keyword == "defrule":
            return tuple(sides(self.node)[1])
        return items[1:] if self.keyword.startswith("def") else (self.node,)

    @cached_property
    def facts(self) -> tuple[FactUse, ...]:
        """The facts that it makes, if they are literal."""
        made: list[SyntaxNode] = list(self.actions) if self.keyword == "deffacts" else []
        for action in self.actions:
            made += (fact for node in action.walk() if node.head == "assert" for fact in node.arguments)
        single = self._single
        return tuple(_fact(node, single) for node in made if node.head)

    @cached_property
    def _single(self) -> frozenset[str]:
        """The variables of a rule that have one value each: those of its condition, as ``?x``."""
        if self.keyword != "defrule":
            return frozenset()
        words = [node.text for node in self.node.walk() if node.items is None]
        before = set(words[: words.index("=>")] if "=>" in words else ())
        bound = {
            node.arguments[0].text for node in self.node.walk() if node.head == "bind" and node.arguments
        }
        return frozenset(word for word in before - bound if word.startswith("?") and f"${word}" not in before)

    @cached_property
    def symbols(self) -> frozenset[str]:
        """The words in its commands, and the texts, each as a whole."""
        nodes = (node for action in self.actions for node in action.walk() if node.items is None)
        return frozenset(map(literal, nodes))

    @cached_property
    def compared(self) -> frozenset[str]:
        """The words that something is compared with, in conditions, tests and queries."""
        return frozenset(
            literal(value)
            for node in self.node.walk()
            if node.head in _COMPARISONS
            for value in node.arguments
        )

    def sets_mode(self, mode: str) -> bool:
        """Whether it may give a goal a mode: that one, or one that is computed."""
        return any(
            node.head == "mode" and any(literal(value) in (mode, "") for value in node.arguments)
            for action in self.actions
            for node in action.walk()
        )

    @cached_property
    def words(self) -> frozenset[str]:
        """All words in its commands, in the conditions of tests, and in its texts."""
        return frozenset(
            word
            for action in self.actions
            for node in action.walk()
            if node.items is None
            for word in _WORD.findall(node.text)
        )


def constructs_of(file: SourceFile) -> tuple[Construct, ...]:
    """Return the constructs of a file."""
    return tuple(Construct(file, placed) for placed in file.pieces if placed.piece.keyword)


def _pattern(ce: PatternCE) -> FactUse:
    named = frozenset(part.slot for part in ce.parts if part.slot)
    count = ce.count if ce.is_ordered else None
    return FactUse(without_module(ce.template), ce.node.start, ce.slots, named, count)


def _fact(node: SyntaxNode, single: frozenset[str]) -> FactUse:
    """Read a fact that is made.

    :param single: variables that have one value each.
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
    """All that the files of an agent match and make.

    :param others: words that reach rules from outside: values of the configuration.
    :param deftemplates: those with slots that CLIPS has.
    :param of_core: the templates that files of the core name.
    :param constructs: those of all files, in their order.
    """

    model: AgentModel
    others: frozenset[str] = frozenset()
    deftemplates: frozenset[str] = frozenset()
    of_core: frozenset[str] = frozenset()
    constructs: tuple[Construct, ...] = ()

    @cached_property
    def made(self) -> dict[str, list[tuple[Construct, FactUse]]]:
        """The facts that constructs make, by their templates."""
        found: dict[str, list[tuple[Construct, FactUse]]] = {}
        for construct in self.constructs:
            for fact in construct.facts:
                found.setdefault(fact.template, []).append((construct, fact))
        return found

    @cached_property
    def templates_in_texts(self) -> frozenset[str]:
        """Words behind a parenthesis in texts: templates of facts that ``assert-string`` or ``eval`` make."""
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
        """The number of constructs whose commands contain a word, or a text of one word."""
        return Counter(word for construct in self.constructs for word in construct.symbols)

    def changed(self, template: str) -> bool:
        """Whether a fact of a template is duplicated, which makes one."""
        return any(
            node.head == "duplicate"
            for construct in self.constructs
            if template in {pattern.template for pattern in construct.patterns}
            for action in construct.actions
            for node in action.walk()
        )

    def is_made_elsewhere(self, template: str) -> bool:
        """Whether anybody may make a fact of a template in a way that is not an assertion of a construct."""
        if template in self.templates_in_texts or self._is_of_program(template) or self._loads_facts:
            return True
        is_defined = self.model.is_defined(Name(NameKind.TEMPLATE, template))
        # a template that no file defines and that has slots is one of an interface or of a feature
        return (not is_defined and template in self.deftemplates) or self.changed(template)

    @cached_property
    def _loads_facts(self) -> bool:
        """Whether facts come from files that were not read here."""
        called = self.model.names(NameKind.FUNCTION, Use.CALLED)
        return not called.isdisjoint(("load-facts", "bload-facts", "bload"))

    def _is_of_program(self, template: str) -> bool:
        """Whether a template may be one of the program's: not if it is nearly one that is known."""
        if not OF_PROGRAM.fullmatch(template) or template in self.of_core:
            return bool(OF_PROGRAM.fullmatch(template))
        return not nearest(template, self.of_core | self.made.keys(), _NEARLY)

    def find(self, file: str, keyword: str, name: str) -> Construct | None:
        """Return the last construct of this name in a file."""
        found = [
            each
            for each in self.constructs
            if (each.file.path, each.keyword, each.name) == (file, keyword, name)
        ]
        return found[-1] if found else None

    def read_templates(self) -> set[str]:
        """Return the templates that a pattern or a query asks for."""
        return self.model.names(NameKind.TEMPLATE, Use.MATCHED, Use.QUERIED)
