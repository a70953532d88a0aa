"""Parser of rule conditions, and their dependencies on functions and global variables."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from cxbridge.clipstext.condition import CE, PatternCE, elements
from cxbridge.clipstext.syntax import SyntaxNode, one_line, read, without_module
from cxbridge.errors import ClipsError

_GLOBAL = re.compile(r"\?\*(.+)\*\Z")
# Prefixes of functions that query facts of any template.
_QUERIES = ("do-for-", "delayed-do-for-", "find-fact", "find-all-facts", "any-factp", "get-fact-list")


class Prefix:
    """The conditional elements at the start of a condition, with a variable for the fact of each pattern.

    :ivar texts: the conditional elements.
    :ivar facts: the fact variables of the patterns.
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
        """The variables bound by these conditional elements."""
        return frozenset(self._first)

    def origin(self, name: str) -> int:
        """Return the number of the conditional element that binds a variable, from 1."""
        return self._first[name]


@dataclass(frozen=True, slots=True)
class Condition:
    """The left-hand side of a rule.

    :param salience: the salience expression, or an empty text.
    :param functions: the functions that the condition calls.
    :param globals: the global variables it reads, without ``?*`` and ``*``.
    """

    rule: str
    salience: str
    ces: tuple[CE, ...]
    functions: frozenset[str]
    globals: frozenset[str]


def parse_rule(text: str) -> Condition:
    """Parse a defrule.

    :raises ClipsError: if the text is not a defrule.
    """
    nodes = read(text)
    if len(nodes) != 1 or nodes[0].head != "defrule" or not nodes[0].arguments:
        raise ClipsError("this is not a defrule")
    first, *items = nodes[0].arguments
    name = without_module(first.text)
    if items and items[0].text.startswith('"'):
        del items[0]
    arrow = next((index for index, node in enumerate(items) if node.text == "=>"), None)
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
    """The dependencies of a condition on definitions other than templates.

    :param functions: texts of the called deffunctions, direct or indirect; callees first.
    :param globals: the global variables in the condition and in the functions.
    :param all_facts: whether a function may query facts of any template.
    """

    functions: tuple[str, ...]
    globals: frozenset[str]
    all_facts: bool


def dependencies(condition: Condition, text_of: Callable[[str], str | None]) -> Dependencies:
    """Return the dependencies of a condition.

    :param text_of: returns the text of a deffunction, or None if it is undefined.
    :raises ClipsError: if the calls are nested too deep.
    """
    texts: dict[str, str] = {}
    function_names, global_names = set(condition.functions), set(condition.globals)

    def visit(names: frozenset[str]) -> None:
        for name in sorted(names):
            text = None if name in texts else text_of(name)
            if text is None:
                continue
            texts[name] = ""  # marks the function as visited: it may be recursive
            nodes = tuple(read(text))
            inner = called(nodes)
            function_names.update(inner)
            global_names.update(named_globals(nodes))
            visit(inner)
            del texts[name]  # insert again at the end: callees come first
            texts[name] = text

    try:
        visit(condition.functions)
    except RecursionError:
        raise ClipsError(f"the functions of '{condition.rule}' call one another too deep") from None
    queries = any(word.startswith(_QUERIES) for word in function_names)
    return Dependencies(tuple(filter(None, texts.values())), frozenset(global_names), queries)


def called(nodes: tuple[SyntaxNode, ...]) -> frozenset[str]:
    """Return the first words of all lists; functions are among them."""
    return frozenset(node.head for top in nodes for node in top.walk() if node.head)


def named_globals(nodes: tuple[SyntaxNode, ...]) -> frozenset[str]:
    matches = (_GLOBAL.match(node.text) for top in nodes for node in top.walk() if node.items is None)
    return frozenset(match[1] for match in matches if match)
