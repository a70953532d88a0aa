"""The rules of a CLIPS file as one stops at them: their lines, and the actions of their right-hand sides."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.condition import CE, GroupCE, PatternCE, condition_of, sides
from cxbridge.clipstext.syntax import Definition, Lines, SyntaxNode, definitions

_BODIES: Final = {"progn": 0, "while": 1, "loop-for-count": 1, "progn$": 1, "foreach": 2}
"""Functions whose arguments from this one on are actions."""

_QUERIES: Final = tuple(
    f"{late}do-for-{facts}" for late in ("", "delayed-") for facts in ("fact", "all-facts")
)
_WORDS: Final = ("then", "else", "do")


@dataclass(frozen=True, slots=True)
class RuleAction:
    """An action of a right-hand side.

    :param start: where it begins in the text.
    :param line: the line that it begins on, from 1.
    :param names: the variables that have a value there for sure, without ``?``.
    """

    start: int
    line: int
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FileRule:
    """A rule of a file.

    :param first: the line that it begins on, from 1, and ``last`` the one that it ends on.
    :param actions: of its right-hand side, in the order of the text.
    """

    name: str
    first: int
    last: int
    actions: tuple[RuleAction, ...]


def rules_of(text: str) -> Iterator[FileRule]:
    """Yield the rules of a file that are closed, in their order."""
    lines = Lines(text)
    for found in definitions(text):
        if found.kind == "defrule":
            last = lines.at(found.node.end - 1)
            yield FileRule(found.name, found.line, last, tuple(_actions(found, lines)))


def _actions(rule: Definition, lines: Lines) -> Iterator[RuleAction]:
    try:
        names = bound(condition_of(rule.node))
    except RecursionError:
        return
    yield from _sequence(sides(rule.node)[1], names, lines)


def bound(ces: Sequence[CE]) -> tuple[str, ...]:
    """Return the variables that conditional elements give a value to, whichever branch of an ``or`` holds."""
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
    """Yield the actions of a sequence, each before those within it."""
    for node in nodes:
        if node.items is None:
            continue
        yield RuleAction(node.start, lines.at(node.start), names)
        for inner, more in _within(node):
            yield from _sequence(inner, (*names, *(name for name in more if name not in names)), lines)
        names = _after(node, names)


def _within(node: SyntaxNode) -> Iterator[tuple[Sequence[SyntaxNode], tuple[str, ...]]]:
    """Yield the sequences of actions in an action, and the variables that it gives them."""
    head, items = node.head, node.arguments
    if head == "if":
        words = [place for place, item in enumerate(items) if item.text in _WORDS]
        for begin, end in zip(words, [*words[1:], len(items)], strict=True):
            yield items[begin + 1 : end], ()
    elif head in _BODIES:
        yield items[_BODIES[head] :], _loop_names(head, items)
    elif head in _QUERIES and items:
        found = (_variable(each.items[0]) for each in items[0].items or () if each.items)
        yield items[2:], tuple(filter(None, found))


def _loop_names(head: str, items: Sequence[SyntaxNode]) -> tuple[str, ...]:
    if not items or head in ("progn", "while"):
        return ()
    first = items[0]
    name = _variable(first if first.items is None else (first.items or (first,))[0])
    return (name,) if name else ()


def _variable(node: SyntaxNode) -> str:
    """Return the name of a local variable; empty for anything else."""
    text = node.text
    return text.lstrip("$?") if node.items is None and text.startswith(("?", "$?")) else ""


def _after(node: SyntaxNode, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the variables that have a value after an action."""
    if node.head != "bind" or not node.arguments:
        return names
    name = _variable(node.arguments[0])
    if not name or name.startswith("*"):
        return names
    rest = tuple(each for each in names if each != name)
    return (*rest, name) if len(node.arguments) > 1 else rest
