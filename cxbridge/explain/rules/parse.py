"""Reads the condition of a rule, and what it needs beside facts."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from cxbridge.clipstext.syntax import SyntaxNode, one_line, read, without_module
from cxbridge.errors import ClipsError
from cxbridge.explain.rules.condition import (
    CE,
    Condition,
    FieldConstraint,
    GroupCE,
    PatternCE,
    SlotConstraint,
    TestCE,
    variables,
)

_GLOBAL = re.compile(r"\?\*(.+)\*\Z")
_QUERIES = ("do-for-", "delayed-do-for-", "find-fact", "find-all-facts", "any-factp", "get-fact-list")
"""How functions begin that ask for facts of any template."""


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
        ces = tuple(_elements(items))
    except RecursionError:
        raise ClipsError(f"the condition of {name} is nested too deep") from None
    return Condition(name, salience, ces, called(used), named_globals(used))


@dataclass(frozen=True, slots=True)
class Dependencies:
    """What a condition needs beside facts.

    :param functions: the deffunctions that it calls, and those that these call, as text; callees first.
    :param globals: the global variables in the condition and in the functions.
    :param all_facts: whether it may ask for facts of any template, by a function.
    """

    functions: tuple[str, ...]
    globals: frozenset[str]
    all_facts: bool


def dependencies(condition: Condition, text_of: Callable[[str], str | None]) -> Dependencies:
    """Return what a condition needs.

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
            del texts[name]  # what it calls comes before it
            texts[name] = text

    try:
        visit(condition.functions)
    except RecursionError:
        raise ClipsError(f"the functions of '{condition.rule}' call one another too deep") from None
    queries = any(word.startswith(_QUERIES) for word in words)
    return Dependencies(tuple(filter(None, texts.values())), frozenset(global_names), queries)


def called(nodes: tuple[SyntaxNode, ...]) -> frozenset[str]:
    """Return all words that stand first in a list: functions, among others."""
    return frozenset(node.head for top in nodes for node in top.walk() if node.head)


def named_globals(nodes: tuple[SyntaxNode, ...]) -> frozenset[str]:
    """Return the names of the global variables in some nodes."""
    found = (_GLOBAL.match(node.text) for top in nodes for node in top.walk() if node.items is None)
    return frozenset(match[1] for match in found if match)


def patterns(ces: tuple[CE, ...]) -> Iterator[PatternCE]:
    """Yield all patterns, those within groups, too."""
    for ce in ces:
        if isinstance(ce, PatternCE):
            yield ce
        elif isinstance(ce, GroupCE):
            yield from patterns(ce.items)


def _elements(items: Sequence[SyntaxNode]) -> Iterator[CE]:
    """Yield the CEs of a list; ``and`` and ``logical`` are gone."""
    for nodes in _joined_bindings(items):
        node = nodes[-1]
        if len(nodes) > 1:
            yield _pattern(node, nodes[0].text.lstrip("$?"))
        elif node.items is None:
            continue
        elif node.head in ("and", "logical"):
            yield from _elements(node.arguments)
        elif node.head == "test":
            yield TestCE(one_line(node.text), variables(node.arguments))
        elif node.head == "or":
            yield GroupCE("or", tuple(map(_branch, _joined_bindings(node.arguments))), one_line(node.text))
        elif node.head in ("not", "exists", "forall"):
            yield GroupCE(node.head, tuple(_elements(node.arguments)), one_line(node.text))
        else:
            yield _pattern(node, "")


def _joined_bindings(items: Sequence[SyntaxNode]) -> Iterator[Sequence[SyntaxNode]]:
    """Yield the elements of a list of CEs; ``?f <- (...)`` is one."""
    place = 0
    while place < len(items):
        binding = items[place : place + 3]
        binds = len(binding) == 3 and binding[1].text == "<-"  # noqa: PLR2004  variable, arrow, pattern
        length = 3 if binds and binding[0].items is None and binding[2].items is not None else 1
        yield items[place : place + length]
        place += length


def _branch(nodes: Sequence[SyntaxNode]) -> CE:
    """Return a branch of an ``or`` as one CE."""
    ces = tuple(_elements(nodes))
    return ces[0] if len(ces) == 1 else GroupCE("and", ces, one_line(" ".join(node.text for node in nodes)))


def _pattern(node: SyntaxNode, variable: str) -> PatternCE:
    rest = node.arguments
    if rest and all(item.items is not None for item in rest):
        parts = [SlotConstraint(item.head, 0, tuple(_fields(item.arguments))) for item in rest]
    else:
        parts = [SlotConstraint("", place, (field,)) for place, field in enumerate(_fields(rest))]
    text = one_line(node.text)
    return PatternCE(node.head, variable, tuple(parts), f"?{variable} <- {text}" if variable else text)


def _fields(nodes: tuple[SyntaxNode, ...]) -> Iterator[FieldConstraint]:
    """Yield the fields of a slot or an ordered pattern: ``& | ~ : =`` tie nodes together."""
    group: list[SyntaxNode] = []
    tied = True
    for node in nodes:
        mark = node.text in ("&", "|")
        if group and not mark and not tied:
            yield _field(group)
            group = []
        group.append(node)
        tied = mark or node.text in ("~", ":", "=")
    if group:
        yield _field(group)


def _field(nodes: list[SyntaxNode]) -> FieldConstraint:
    text = one_line("".join(node.text for node in nodes))
    first = nodes[0].text
    binder = first if first.startswith(("?", "$?")) and not _GLOBAL.match(first) else ""
    if binder and len(nodes) > 1 and nodes[1].text == "|":
        binder = ""
    rest = nodes[2:] if binder else nodes
    alternatives: list[list[list[SyntaxNode]]] = [[[]]]
    for node in rest:
        if node.text == "|":
            alternatives.append([[]])
        elif node.text == "&":
            alternatives[-1].append([])
        else:
            alternatives[-1][-1].append(node)
    made = tuple(tuple(tuple(term) for term in terms if term) for terms in alternatives)
    return FieldConstraint(binder, tuple(terms for terms in made if terms), text)
