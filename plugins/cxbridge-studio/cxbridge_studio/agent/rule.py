"""Reads the condition of a rule, and its dependencies besides facts."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from cxbridge.clipstext.condition import CE, PatternCE, elements
from cxbridge.clipstext.syntax import SyntaxNode, one_line, read, without_module
from cxbridge.errors import ClipsError

_GLOBAL = re.compile(r"\?\*(.+)\*\Z")
_QUERIES = ("do-for-", "delayed-do-for-", "find-fact", "find-all-facts", "any-factp", "get-fact-list")
"""How functions begin that ask for facts of any template."""


class Prefix:
    """The CEs at the start of a condition; each pattern's fact has a variable.

    :ivar texts: the CEs.
    :ivar facts: the variables of the patterns' facts.
    """

    def __init__(self, ces: Sequence[CE]) -> None:
        self.texts: list[str] = []
        self.facts: list[str] = []
        self._first: dict[str, int] = {}
        for number, ce in enumerate(ces, 1):
            if not isinstance(ce, PatternCE):
                self.texts.append(ce.text)
                continue
            variable = ce.variable or f"cx-why-{number}"
            self.texts.append(f"?{variable} <- {ce.bare()}")
            self.facts.append(variable)
            for name in [*sorted(ce.binds), *([ce.variable] if ce.variable else [])]:
                self._first.setdefault(name, number)

    @property
    def binds(self) -> frozenset[str]:
        """The variables that have a value after them."""
        return frozenset(self._first)

    def origin(self, name: str) -> int:
        """Return the number of the CE that binds a variable."""
        return self._first[name]


@dataclass(frozen=True, slots=True)
class Condition:
    """The left-hand side of a rule.

    :param salience: the expression of its salience, empty when it has none.
    :param functions: the functions that it calls.
    :param globals: the global variables in it, without ``?*`` and ``*``.
    """

    rule: str
    salience: str
    ces: tuple[CE, ...]
    functions: frozenset[str]
    globals: frozenset[str]


def parse_rule(text: str) -> Condition:
    """Parse a defrule.

    :raises ClipsError: when it is none.
    """
    nodes = read(text)
    if len(nodes) != 1 or nodes[0].head != "defrule" or not nodes[0].arguments:
        raise ClipsError("this is not a defrule")
    first, *items = nodes[0].arguments
    name = without_module(first.text)
    if items and items[0].text.startswith('"'):
        del items[0]
    arrow = next((place for place, node in enumerate(items) if node.text == "=>"), None)
    if arrow is None:
        raise ClipsError(f"the rule {name} has no =>")
    items = items[:arrow]
    used = tuple(items)
    salience = ""
    if items and items[0].head == "declare":
        for entry in items.pop(0).arguments:
            if entry.head == "salience" and entry.arguments:
                salience = one_line(entry.arguments[0].text)
    try:
        ces = tuple(elements(items))
    except RecursionError:
        raise ClipsError(f"the condition of {name} is nested too deep") from None
    return Condition(name, salience, ces, called(used), named_globals(used))


@dataclass(frozen=True, slots=True)
class Dependencies:
    """The dependencies of a condition besides facts.

    :param functions: the deffunctions that it calls, and those that these call, as text; callees first.
    :param globals: the global variables in the condition and in the functions.
    :param all_facts: whether it may ask for facts of any template, by a function.
    """

    functions: tuple[str, ...]
    globals: frozenset[str]
    all_facts: bool


def dependencies(condition: Condition, text_of: Callable[[str], str | None]) -> Dependencies:
    """Return the dependencies of a condition.

    :param text_of: gives the text of a deffunction; None when there is none of that name.
    :raises ClipsError: when the functions call one another too deep.
    """
    texts: dict[str, str] = {}
    words, global_names = set(condition.functions), set(condition.globals)

    def visit(names: frozenset[str]) -> None:
        for name in sorted(names):
            text = None if name in texts else text_of(name)
            if text is None:
                continue
            texts[name] = ""  # it may call itself
            nodes = tuple(read(text))
            inner = called(nodes)
            words.update(inner)
            global_names.update(named_globals(nodes))
            visit(inner)
            del texts[name]  # called functions come first
            texts[name] = text

    try:
        visit(condition.functions)
    except RecursionError:
        raise ClipsError(f"the functions of '{condition.rule}' call one another too deep") from None
    queries = any(word.startswith(_QUERIES) for word in words)
    return Dependencies(tuple(filter(None, texts.values())), frozenset(global_names), queries)


def called(nodes: tuple[SyntaxNode, ...]) -> frozenset[str]:
    """Return all words that stand first in a list, functions among them."""
    return frozenset(node.head for top in nodes for node in top.walk() if node.head)


def named_globals(nodes: tuple[SyntaxNode, ...]) -> frozenset[str]:
    """Return the names of the global variables in some nodes."""
    found = (_GLOBAL.match(node.text) for top in nodes for node in top.walk() if node.items is None)
    return frozenset(match[1] for match in found if match)
