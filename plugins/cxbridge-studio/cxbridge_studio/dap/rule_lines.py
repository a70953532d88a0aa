"""Finds the lines of rules and of the actions in their right-hand sides, in the text of a CLIPS file.

Breakpoints on lines and the probes in right-hand sides use the same positions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.syntax import Definition, Lines, SyntaxNode, definitions
from cxbridge.errors import CxbridgeError
from cxbridge_studio.agent.condition import CE, GroupCE, PatternCE, parse_condition, split_rule

# the functions whose last arguments are actions, with the index of the first action
_BODY_STARTS: Final = {"progn": 0, "while": 1, "loop-for-count": 1, "progn$": 1, "foreach": 2}

_FACT_QUERIES: Final = ("do-for-fact", "do-for-all-facts", "delayed-do-for-fact", "delayed-do-for-all-facts")
_BRANCH_WORDS: Final = ("then", "else")  # the words before the actions of an `if`


@dataclass(frozen=True, slots=True)
class RuleAction:
    """An action of a right-hand side.

    :param start: the offset of the action in the text.
    :param line: the first line of the action, from 1.
    :param names: the variables that are always bound at the action, without ``?``.
    """

    start: int
    line: int
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FileRule:
    """A rule of a file.

    :param first_line: the first line of the rule, from 1.
    :param last_line: the last line of the rule.
    :param actions: the actions of the rule's right-hand side, in the order of the text.
    """

    name: str
    first_line: int
    last_line: int
    actions: tuple[RuleAction, ...]


def find_rules(text: str) -> Iterator[FileRule]:
    """Yield the rules of a file in order, except an unfinished rule at the end of the text."""
    lines = Lines(text)
    for definition in definitions(text):
        if definition.kind == "defrule":
            last_line = lines.line_at(definition.node.end - 1)
            actions = tuple(_find_actions(definition, lines))
            yield FileRule(definition.name, definition.line, last_line, actions)


def _find_actions(rule: Definition, lines: Lines) -> Iterator[RuleAction]:
    try:
        names = find_bound_names(parse_condition(rule.node))
    except RecursionError:  # a deeply nested condition of a hostile file: its rule gets no probes
        return
    _, right_hand_side = split_rule(rule.node)
    yield from _find_nested_actions(right_hand_side, names, lines)


def find_bound_names(ces: Sequence[CE]) -> tuple[str, ...]:
    """Return the variables that conditional elements bind; of an ``or``, those that all branches bind."""
    names: set[str] = set()
    for ce in ces:
        if isinstance(ce, PatternCE):
            names |= ce.bound_variables | ({ce.variable} if ce.variable else set())
        elif isinstance(ce, GroupCE) and ce.kind == "and":
            names.update(find_bound_names(ce.items))
        elif isinstance(ce, GroupCE) and ce.kind == "or":
            # a file in the editor may have an unfinished `(or)` without branches
            names |= (
                set.intersection(*(set(find_bound_names((branch,))) for branch in ce.items))
                if ce.items
                else set()
            )
    return tuple(sorted(names))


def _find_nested_actions(
    nodes: Iterable[SyntaxNode], names: tuple[str, ...], lines: Lines
) -> Iterator[RuleAction]:
    """Yield the actions of a sequence, each before its nested actions."""
    for node in nodes:
        if node.items is None:
            continue
        yield RuleAction(node.start, lines.line_at(node.start), names)
        for inner_nodes, added_names in _find_nested_sequences(node):
            yield from _find_nested_actions(inner_nodes, tuple(dict.fromkeys((*names, *added_names))), lines)
        names = _find_names_after(node, names)


def _find_nested_sequences(node: SyntaxNode) -> Iterator[tuple[Sequence[SyntaxNode], tuple[str, ...]]]:
    """Yield the action sequences within an action, each with the variables that the action binds for it."""
    head, arguments = node.head, node.arguments
    if head == "if":
        starts = [index for index, argument in enumerate(arguments) if argument.text in _BRANCH_WORDS]
        for start, end in zip(starts, [*starts[1:], len(arguments)], strict=True):
            yield arguments[start + 1 : end], ()
    elif head in _BODY_STARTS:
        yield arguments[_BODY_STARTS[head] :], _find_loop_names(head, arguments)
    elif head in _FACT_QUERIES and arguments:
        names = (read_variable_name(member.items[0]) for member in arguments[0].items or () if member.items)
        yield arguments[2:], tuple(filter(None, names))  # the actions follow the members and the test


def _find_loop_names(head: str, arguments: Sequence[SyntaxNode]) -> tuple[str, ...]:
    if not arguments or head in ("progn", "while"):
        return ()
    argument = arguments[0]
    # the variable, or the list that begins with it, as in (loop-for-count (?i 1 3) ...)
    name = read_variable_name(argument if argument.items is None else (argument.items or (argument,))[0])
    return (name,) if name else ()


def read_variable_name(node: SyntaxNode) -> str:
    """Return the name of a local variable, with the slot of ``?fact:slot``; empty for other nodes."""
    is_local = node.text.startswith(("?", "$?")) and not node.text.startswith("?*")  # ?*NAME* is global
    return node.text.lstrip("$?") if node.items is None and is_local else ""


def _find_names_after(node: SyntaxNode, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the variables that are bound after an action."""
    name = read_variable_name(node.arguments[0]) if node.head == "bind" and node.arguments else ""
    if not name:
        return names
    kept_names = tuple(other_name for other_name in names if other_name != name)
    return (*kept_names, name) if len(node.arguments) > 1 else kept_names  # (bind ?x) unbinds


def find_stop_line(
    rules: Iterable[FileRule], line: int, *, includes_actions: bool = True
) -> tuple[FileRule, int]:
    """Return where a breakpoint on a line stops: at the rule with the line or at the next rule.

    Within the rule, it stops at the last action that begins at the line or above, if there is one.

    :param rules: the rules of a file in order.
    :param includes_actions: whether the run can stop at actions.
    :returns: the rule and the line of its action; 0 to stop before the rule.
    :raises CxbridgeError: if the line is after the last rule.
    """
    rule = next((rule for rule in rules if line <= rule.last_line), None)
    if rule is None:
        raise CxbridgeError("no rule begins at this line or below")
    action_lines = [action.line for action in rule.actions if action.line <= line and includes_actions]
    return rule, max(action_lines, default=0)
