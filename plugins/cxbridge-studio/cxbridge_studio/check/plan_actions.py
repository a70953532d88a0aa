"""Finds the actions that an agent puts into plans: as asserted facts, or by functions of the agent.

Many agents have a function that asserts plan-actions from its arguments: its calls are plan-actions, too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, literal
from cxbridge_studio.check.agent import ClipsFile

_FACT: Final = "plan-action"

Values = tuple[SyntaxNode, ...]


@dataclass(frozen=True, slots=True)
class SourceAction:
    """A plan-action in the source text.

    :param name: the node with the action's name.
    :param node: the assertion or call.
    :param names: names of parameters; None if they are missing or computed.
    :param values: values of parameters; None if they are missing or computed.
    """

    file: ClipsFile
    name: SyntaxNode
    node: SyntaxNode
    names: Values | None
    values: Values | None


@dataclass(frozen=True, slots=True)
class _Builder:
    """A function that asserts a plan-action from its arguments.

    :param action: index of the argument with the action's name.
    :param names: index of the argument with the parameters' names, or None.
    :param values: index of the argument with the parameters' values, or None.
    :param wildcard: index of the wildcard parameter ``$?NAME``, or None.
    """

    action: int
    names: int | None
    values: int | None
    wildcard: int | None

    def argument(self, call: SyntaxNode, number: int | None) -> Values | None:
        """Return the values of an argument of a call; None if they are missing or computed."""
        if number is None or number >= len(call.arguments):
            return () if number is not None and number == self.wildcard else None
        if number == self.wildcard:
            return call.arguments[number:]
        return field_values(call.arguments[number : number + 1])


def source_actions(files: Iterable[ClipsFile]) -> Iterator[SourceAction]:
    """Yield the actions with literal names."""
    files = list(files)
    builders = dict(pair for file in files for pair in _builders(file))
    for file in files:
        for call in file.calls("assert"):
            for fact in call.arguments:
                if fact.head == _FACT:
                    yield from _of_fact(file, fact)
        for call in file.calls(*builders):
            builder = builders[call.head]
            if len(call.arguments) > builder.action and literal(call.arguments[builder.action]):
                yield SourceAction(
                    file,
                    call.arguments[builder.action],
                    call,
                    # An empty list: the names come from the operator.
                    builder.argument(call, builder.names) or None,
                    builder.argument(call, builder.values),
                )


def _of_fact(file: ClipsFile, fact: SyntaxNode) -> Iterator[SourceAction]:
    slots = {item.head: item.arguments for item in fact.arguments if item.head}
    name = slots.get("action-name", ())
    if len(name) == 1 and literal(name[0]):
        names, values = slots.get("param-names"), slots.get("param-values")
        yield SourceAction(
            file,
            name[0],
            fact,
            None if names is None else field_values(names),
            None if values is None else field_values(values),
        )


def _builders(file: ClipsFile) -> Iterator[tuple[str, _Builder]]:
    """Yield the functions that assert a plan-action with a name from an argument."""
    for construct in file.constructs:
        if construct.kind != "deffunction":
            continue
        items = next((node.items for node in construct.node.arguments[1:3] if node.items is not None), ())
        parameters = [item.text for item in items]
        # A body writes ?x or $?x for the parameter $?x.
        names = [text.removeprefix("$") for text in parameters]

        def number(fact: SyntaxNode, slot: str, names: list[str] = names) -> int | None:
            values = next((item.arguments for item in fact.arguments if item.head == slot), ())
            text = values[0].text.removeprefix("$") if len(values) == 1 else ""
            return names.index(text) if text in names else None

        for fact in construct.node.walk():
            action = number(fact, "action-name") if fact.head == _FACT else None
            if action is not None:
                wildcards = (index for index, text in enumerate(parameters) if text.startswith("$"))
                param_names, param_values = number(fact, "param-names"), number(fact, "param-values")
                builder = _Builder(action, param_names, param_values, next(wildcards, None))
                yield construct.name, builder


def field_values(values: Values) -> Values | None:
    """Return the values of a slot or an argument; None if a variable may hold any number of values."""
    if len(values) == 1 and values[0].head == "create$":
        values = values[0].arguments
    elif len(values) == 1 and values[0].text.startswith("?"):
        return None
    return values


def count(values: Values) -> int | None:
    """Return the number of values; None if one of them may be any number."""
    is_open = any(value.items is not None or value.text.startswith("$?") for value in values)
    return None if is_open else len(values)
