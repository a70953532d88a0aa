"""The rules of a CLIPS file with their lines, and the actions of their right-hand sides."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.condition import CE, GroupCE, PatternCE, condition_of, sides
from cxbridge.clipstext.syntax import Definition, Lines, SyntaxNode, definitions

# Functions with actions as arguments, and the index of the first action.
_BODIES: Final = {"progn": 0, "while": 1, "loop-for-count": 1, "progn$": 1, "foreach": 2}

_QUERIES: Final = tuple(
    f"{late}do-for-{facts}" for late in ("", "delayed-") for facts in ("fact", "all-facts")
)
_WORDS: Final = ("then", "else", "do")


@dataclass(frozen=True, slots=True)
class RuleAction:
    """An action of a right-hand side.

    :param start: its offset in the text.
    :param line: its first line, from 1.
    :param names: the variables that are certainly bound there, without ``?``.
    """

    start: int
    line: int
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FileRule:
    """A rule of a file.

    :param first: its first line, from 1.
    :param last: its last line.
    :param actions: the actions of its right-hand side, in the order of the text.
    """

    name: str
    first: int
    last: int
    actions: tuple[RuleAction, ...]


def rules_of(text: str) -> Iterator[FileRule]:
    """Yield the closed rules of a file, in order."""
    lines = Lines(text)
    for definition in definitions(text):
        if definition.kind == "defrule":
            last = lines.at(definition.node.end - 1)
            yield FileRule(definition.name, definition.line, last, tuple(_actions(definition, lines)))


def _actions(rule: Definition, lines: Lines) -> Iterator[RuleAction]:
    try:
        names = bound(condition_of(rule.node))
    except RecursionError:
        return
    yield from _sequence(sides(rule.node)[1], names, lines)


def bound(ces: Sequence[CE]) -> tuple[str, ...]:
    """Return the variables that conditional elements bind; of an ``or``, those that all branches bind."""
    names: dict[str, None] = {}
    for ce in ces:
        if isinstance(ce, PatternCE):
            names |= dict.fromkeys((ce.variable,) if ce.variable else ())
            names |= dict.fromkeys(field.name for part in ce.parts for field in part.fields if field.name)
        elif isinstance(ce, GroupCE) and ce.kind == "and":
            names |= dict.fromkeys(bound(ce.items))
        elif isinstance(ce, GroupCE) and ce.kind == "or":
            branches = [bound((branch,)) for branch in ce.items]
            names |= dict.fromkeys(name for name in branches[0] if all(name in each for each in branches))
    return tuple(names)


def _sequence(nodes: Iterable[SyntaxNode], names: tuple[str, ...], lines: Lines) -> Iterator[RuleAction]:
    """Yield the actions of a sequence, each before its nested actions."""
    for node in nodes:
        if node.items is None:
            continue
        yield RuleAction(node.start, lines.at(node.start), names)
        for inner, added_names in _within(node):
            yield from _sequence(inner, (*names, *(name for name in added_names if name not in names)), lines)
        names = _after(node, names)


def _within(node: SyntaxNode) -> Iterator[tuple[Sequence[SyntaxNode], tuple[str, ...]]]:
    """Yield the nested action sequences of an action, with the variables that it binds for each."""
    head, items = node.head, node.arguments
    if head == "if":
        words = [index for index, item in enumerate(items) if item.text in _WORDS]
        for begin, end in zip(words, [*words[1:], len(items)], strict=True):
            yield items[begin + 1 : end], ()
    elif head in _BODIES:
        yield items[_BODIES[head] :], _loop_names(head, items)
    elif head in _QUERIES and items:
        names = (_variable(each.items[0]) for each in items[0].items or () if each.items)
        yield items[2:], tuple(filter(None, names))


def _loop_names(head: str, items: Sequence[SyntaxNode]) -> tuple[str, ...]:
    if not items or head in ("progn", "while"):
        return ()
    first = items[0]
    name = _variable(first if first.items is None else (first.items or (first,))[0])
    return (name,) if name else ()


def _variable(node: SyntaxNode) -> str:
    """Return the name of a local variable; empty for other nodes."""
    text = node.text
    return text.lstrip("$?") if node.items is None and text.startswith(("?", "$?")) else ""


def _after(node: SyntaxNode, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the bound variables after an action."""
    if node.head != "bind" or not node.arguments:
        return names
    name = _variable(node.arguments[0])
    if not name or name.startswith("*"):
        return names
    rest = tuple(each for each in names if each != name)
    return (*rest, name) if len(node.arguments) > 1 else rest
