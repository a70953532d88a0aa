"""Finds the actions that an agent puts into plans: as asserted facts, or by functions of the agent.

Many agents have a function that asserts a plan-action from its arguments. Each call of such a function is a
plan-action, too.
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

    :param file: the CLIPS file with the plan-action.
    :param name: the node with the action's name.
    :param node: the asserted fact, or the call of the function.
    :param names: the names of the parameters; None if they are missing or computed.
    :param values: the values of the parameters; None if they are missing or computed.
    """

    file: ClipsFile
    name: SyntaxNode
    node: SyntaxNode
    names: Values | None
    values: Values | None


@dataclass(frozen=True, slots=True)
class _Builder:
    """A function that asserts a plan-action from its arguments.

    :param action: the index of the argument with the action's name.
    :param names: the index of the argument with the parameters' names, or None.
    :param values: the index of the argument with the parameters' values, or None.
    :param wildcard: the index of the wildcard parameter ``$?NAME``, or None.
    """

    action: int
    names: int | None
    values: int | None
    wildcard: int | None

    def argument(self, call: SyntaxNode, index: int | None) -> Values | None:
        """Return the values of an argument of a call; None if they are missing or computed."""
        if index is None or index >= len(call.arguments):
            return () if index is not None and index == self.wildcard else None
        if index == self.wildcard:  # takes all remaining arguments
            return call.arguments[index:]
        return field_values(call.arguments[index : index + 1])


def source_actions(files: Iterable[ClipsFile]) -> Iterator[SourceAction]:
    """Yield the plan-actions with literal names."""
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
                    # An empty list of names means that the operator has the names.
                    builder.argument(call, builder.names) or None,
                    builder.argument(call, builder.values),
                )


def _of_fact(file: ClipsFile, fact: SyntaxNode) -> Iterator[SourceAction]:
    """Yield the plan-action of an asserted fact if its name is literal."""
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
    """Yield the name and the arguments of each function that asserts a plan-action named by an argument."""
    for construct in file.constructs:
        if construct.kind != "deffunction":
            continue
        # The list of parameters follows the name, or the optional comment after the name.
        items = next((node.items for node in construct.node.arguments[1:3] if node.items is not None), ())
        parameters = [item.text for item in items]
        # The body may refer to the parameter $?x as ?x or as $?x.
        names = [text.removeprefix("$") for text in parameters]

        def index_of(fact: SyntaxNode, slot: str, names: list[str] = names) -> int | None:
            """Return the index of the parameter that is the only value of a slot."""
            values = next((item.arguments for item in fact.arguments if item.head == slot), ())
            text = values[0].text.removeprefix("$") if len(values) == 1 else ""
            return names.index(text) if text in names else None

        for fact in construct.node.walk():
            action = index_of(fact, "action-name") if fact.head == _FACT else None
            if action is not None:
                wildcards = (index for index, text in enumerate(parameters) if text.startswith("$"))
                param_names, param_values = index_of(fact, "param-names"), index_of(fact, "param-values")
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
    """Return the number of values; None if a call or a multifield variable gives an unknown number."""
    is_open = any(value.items is not None or value.text.startswith("$?") for value in values)
    return None if is_open else len(values)
