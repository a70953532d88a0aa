"""Finds the actions that an agent puts into plans: as asserted facts, or by functions of the agent.

Many agents have a function that asserts a plan-action from its arguments, here called a builder. Each call of
a builder counts as a plan-action.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, literal
from cxbridge_studio.check.agent import ClipsFile

_PLAN_ACTION: Final = "plan-action"

ValueNodes = tuple[SyntaxNode, ...]  # the nodes of a list of values in the source text


@dataclass(frozen=True, slots=True)
class SourceAction:
    """A plan-action in the source text.

    :param file: the CLIPS file with the plan-action.
    :param name_node: the node with the action's name.
    :param node: the asserted fact, or the call of the function.
    :param names: the nodes of the parameters' names, some of which may be computed. None if they are missing,
        if one variable holds them all, and for the call of a function.
    :param values: the nodes of the parameters' values; None as for the names.
    """

    file: ClipsFile
    name_node: SyntaxNode
    node: SyntaxNode
    names: ValueNodes | None
    values: ValueNodes | None


def find_source_actions(files: Iterable[ClipsFile]) -> Iterator[SourceAction]:
    """Yield the plan-actions with literal names."""
    files = list(files)
    builders = dict(pair for file in files for pair in _find_builders(file))
    for file in files:
        for call in file.find_calls("assert"):
            for fact in call.arguments:
                if fact.head == _PLAN_ACTION:
                    yield from _find_fact_actions(file, fact)
        for call in file.find_calls(*builders):
            index = builders[call.head]
            if len(call.arguments) > index and literal(call.arguments[index]):
                yield SourceAction(file, call.arguments[index], call, None, None)


def _find_fact_actions(file: ClipsFile, fact: SyntaxNode) -> Iterator[SourceAction]:
    """Yield the plan-action of an asserted fact if its name is literal."""
    slots = {item.head: item.arguments for item in fact.arguments if item.head}
    name = slots.get("action-name", ())
    if len(name) == 1 and literal(name[0]):
        names, values = slots.get("param-names"), slots.get("param-values")
        yield SourceAction(
            file,
            name[0],
            fact,
            None if names is None else _list_values(names),
            None if values is None else _list_values(values),
        )


def _find_builders(file: ClipsFile) -> Iterator[tuple[str, int]]:
    """Yield the name of each builder, and the index of the argument with the action's name.

    A function counts as a builder if a list ``(action-name ?x)`` in it has one of its parameters.
    """
    for construct in file.constructs:
        if construct.kind != "deffunction":
            continue
        # The list of parameters follows the name, or the optional comment after the name.
        items = next((node.items for node in construct.node.arguments[1:3] if node.items is not None), ())
        parameters = [item.text for item in items]
        for slot in construct.node.walk():
            if slot.head == "action-name" and slot.arguments and slot.arguments[0].text in parameters:
                yield construct.name, parameters.index(slot.arguments[0].text)


def _list_values(values: ValueNodes) -> ValueNodes | None:
    """Return the nodes of a slot's values, also those in ``create$``; None if a variable holds them all."""
    if len(values) == 1 and values[0].head == "create$":
        values = values[0].arguments
    elif len(values) == 1 and values[0].text.startswith("?"):
        return None
    return values


def count_values(values: ValueNodes) -> int | None:
    """Return the number of values; None if a call or a multifield variable gives an unknown number."""
    has_unknown_count = any(value.items is not None or value.text.startswith("$?") for value in values)
    return None if has_unknown_count else len(values)
