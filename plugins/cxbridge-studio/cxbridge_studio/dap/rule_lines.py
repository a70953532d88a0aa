"""The rules of a CLIPS file by their lines, with the actions of their right-hand sides.

Breakpoints on lines and the probes within right-hand sides need the same positions.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from glob import escape
from typing import Final

from cxbridge.clipstext.syntax import Definition, Lines, SyntaxNode, definitions
from cxbridge_studio.agent.condition import CE, GroupCE, PatternCE, parse_condition, sides
from cxbridge_studio.debugger.breakpoints import Breakpoint

# The functions that take actions as arguments, with the index of the first action.
_BODIES: Final = {"progn": 0, "while": 1, "loop-for-count": 1, "progn$": 1, "foreach": 2}

_QUERIES: Final = ("do-for-fact", "do-for-all-facts", "delayed-do-for-fact", "delayed-do-for-all-facts")
_BRANCHES: Final = ("then", "else", "do")  # words before the actions of an `if`


@dataclass(frozen=True, slots=True)
class RuleAction:
    """An action of a right-hand side.

    :param start: the offset of the action in the text.
    :param line: the first line of the action, from 1.
    :param names: the variables that are certainly bound there, without ``?``.
    """

    start: int
    line: int
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FileRule:
    """A rule of a file.

    :param first: the first line of the rule, from 1.
    :param last: the last line of the rule.
    :param actions: the actions of the rule's right-hand side, in the order of the text.
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
        names = bound_names(parse_condition(rule.node))
    except RecursionError:  # a condition of a hostile file: the rule has no probes
        return
    _, right_hand_side = sides(rule.node)
    yield from _actions_in(right_hand_side, names, lines)


def bound_names(ces: Sequence[CE]) -> tuple[str, ...]:
    """Return the variables that conditional elements bind; of an ``or``, those that all branches bind."""
    names: set[str] = set()
    for ce in ces:
        if isinstance(ce, PatternCE):
            names |= ce.bound_variables | ({ce.variable} if ce.variable else set())
        elif isinstance(ce, GroupCE) and ce.kind == "and":
            names.update(bound_names(ce.items))
        elif isinstance(ce, GroupCE) and ce.kind == "or":
            names |= set.intersection(*(set(bound_names((branch,))) for branch in ce.items))
    return tuple(sorted(names))


def _actions_in(nodes: Iterable[SyntaxNode], names: tuple[str, ...], lines: Lines) -> Iterator[RuleAction]:
    """Yield the actions of a sequence, each before its nested actions."""
    for node in nodes:
        if node.items is None:
            continue
        yield RuleAction(node.start, lines.at(node.start), names)
        for inner_nodes, added_names in _nested_sequences(node):
            yield from _actions_in(inner_nodes, tuple(dict.fromkeys((*names, *added_names))), lines)
        names = _names_after(node, names)


def _nested_sequences(node: SyntaxNode) -> Iterator[tuple[Sequence[SyntaxNode], tuple[str, ...]]]:
    """Yield the nested action sequences of an action, with the variables that it binds for each."""
    head, items = node.head, node.arguments
    if head == "if":
        starts = [index for index, item in enumerate(items) if item.text in _BRANCHES]
        for begin, end in zip(starts, [*starts[1:], len(items)], strict=True):
            yield items[begin + 1 : end], ()
    elif head in _BODIES:
        yield items[_BODIES[head] :], _loop_names(head, items)
    elif head in _QUERIES and items:
        names = (_variable(member.items[0]) for member in items[0].items or () if member.items)
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


def _names_after(node: SyntaxNode, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the variables that are bound after an action."""
    name = _variable(node.arguments[0]) if node.head == "bind" and node.arguments else ""
    if not name or name.startswith("*"):  # ?*NAME*: a global variable
        return names
    kept_names = tuple(other_name for other_name in names if other_name != name)
    return (*kept_names, name) if len(node.arguments) > 1 else kept_names  # (bind ?x) unbinds


@dataclass(frozen=True, slots=True)
class RulePosition:
    """The position of a breakpoint on a line.

    :param line: the line, moved to the next possible position.
    :param action: whether to stop at an action of the rule instead of before the rule.
    """

    rule: str
    line: int
    action: bool

    def breakpoint(self, condition: str = "", hits: str = "", log: str = "") -> Breakpoint:
        kind, state = ("line", str(self.line)) if self.action else ("before", "*")
        return Breakpoint(0, kind, escape(self.rule), state, "*", condition, hits, log)


class FileLines:
    """The lines of a file where a breakpoint is possible.

    :param actions: whether the lines of actions are possible.
    """

    def __init__(self, text: str, *, actions: bool) -> None:
        self._rules: list[FileRule] = list(rules_of(text))
        self._first_lines = [rule.first for rule in self._rules]
        self._actions = actions

    def at(self, line: int) -> RulePosition | None:
        """Return the position for a line; outside a rule, that of the next rule; None after the last rule."""
        number = bisect_right(self._first_lines, line) - 1
        if number < 0 or line > self._rules[number].last:
            number += 1
        if number >= len(self._rules):
            return None
        rule = self._rules[number]
        action_lines = [action.line for action in rule.actions] if self._actions else []
        if action_lines and line >= min(action_lines):
            action_line = max(candidate for candidate in action_lines if candidate <= line)
            return RulePosition(rule.name, action_line, action=True)
        return RulePosition(rule.name, rule.first, action=False)

    def between(self, first: int, last: int) -> list[int]:
        """Return the possible lines in a range."""
        lines = set(self._first_lines)
        if self._actions:
            lines |= {action.line for rule in self._rules for action in rule.actions}
        return sorted(line for line in lines if first <= line <= last)
