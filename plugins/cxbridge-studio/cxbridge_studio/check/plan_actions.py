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
    :param name: the node with the action's name.
    :param node: the asserted fact, or the call of the function.
    :param names: the names of the parameters; None if they are missing or computed.
    :param values: the values of the parameters; None if they are missing or computed.
    """

    file: ClipsFile
    name: SyntaxNode
    node: SyntaxNode
    names: ValueNodes | None
    values: ValueNodes | None


@dataclass(frozen=True, slots=True)
class _Builder:
    """A function that asserts a plan-action from its arguments.

    :param action_index: the index of the argument with the action's name.
    :param names_index: the index of the argument with the parameters' names, or None.
    :param values_index: the index of the argument with the parameters' values, or None.
    :param wildcard_index: the index of the wildcard parameter ``$?NAME``, or None.
    """

    action_index: int
    names_index: int | None
    values_index: int | None
    wildcard_index: int | None

    def read_argument(self, call: SyntaxNode, index: int | None) -> ValueNodes | None:
        """Return the values of an argument of a call; None if they are missing or computed."""
        if index is None or index >= len(call.arguments):
            # A call may omit the wildcard, which is then an empty list.
            return () if index is not None and index == self.wildcard_index else None
        if index == self.wildcard_index:  # the wildcard takes all remaining arguments
            return call.arguments[index:]
        return literal_values(call.arguments[index : index + 1])


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
            builder = builders[call.head]
            if len(call.arguments) > builder.action_index and literal(call.arguments[builder.action_index]):
                yield SourceAction(
                    file,
                    call.arguments[builder.action_index],
                    call,
                    # An empty list of names means that the operator of the domain has the names.
                    builder.read_argument(call, builder.names_index) or None,
                    builder.read_argument(call, builder.values_index),
                )


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
            None if names is None else literal_values(names),
            None if values is None else literal_values(values),
        )


def _find_builders(file: ClipsFile) -> Iterator[tuple[str, _Builder]]:
    """Yield the name and the builder of each function that asserts a plan-action named by an argument."""
    for construct in file.constructs:
        if construct.kind != "deffunction":
            continue
        # The list of parameters follows the name, or the optional comment after the name.
        items = next((node.items for node in construct.node.arguments[1:3] if node.items is not None), ())
        parameters = [item.text for item in items]
        # The body may refer to the parameter $?x as ?x or as $?x.
        names = [text.removeprefix("$") for text in parameters]

        # The default of `names` keeps the names of this construct; a closure would see those of later ones.
        def find_parameter_index(fact: SyntaxNode, slot: str, names: list[str] = names) -> int | None:
            """Return the index of the parameter that is the only value of a slot."""
            values = next((item.arguments for item in fact.arguments if item.head == slot), ())
            text = values[0].text.removeprefix("$") if len(values) == 1 else ""
            return names.index(text) if text in names else None

        for fact in construct.node.walk():
            action_index = find_parameter_index(fact, "action-name") if fact.head == _PLAN_ACTION else None
            if action_index is not None:
                wildcards = (index for index, text in enumerate(parameters) if text.startswith("$"))
                names_index = find_parameter_index(fact, "param-names")
                values_index = find_parameter_index(fact, "param-values")
                builder = _Builder(action_index, names_index, values_index, next(wildcards, None))
                yield construct.name, builder


def literal_values(values: ValueNodes) -> ValueNodes | None:
    """Return the values of a slot or an argument; None if a variable may hold any number of values."""
    if len(values) == 1 and values[0].head == "create$":
        values = values[0].arguments
    elif len(values) == 1 and values[0].text.startswith("?"):
        return None
    return values


def count_literals(values: ValueNodes) -> int | None:
    """Return the number of values; None if a call or a multifield variable gives an unknown number."""
    is_open = any(value.items is not None or value.text.startswith("$?") for value in values)
    return None if is_open else len(values)
