"""The actions that an agent puts into plans: asserted as facts, or by functions that it has for that."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, literal
from cxbridge_studio.check.agent import ClipsFile

_FACT: Final = "plan-action"

Values = tuple[SyntaxNode, ...]


@dataclass(frozen=True, slots=True)
class WrittenAction:
    """An action of a plan, in the source text.

    :param name: the word that names the action.
    :param names: names of parameters; None when none are given, or they are not written out. ``values``
        likewise.
    :param node: where it is made.
    """

    file: ClipsFile
    name: SyntaxNode
    node: SyntaxNode
    names: Values | None
    values: Values | None


@dataclass(frozen=True, slots=True)
class _Builder:
    """A function that asserts a plan-action of its arguments.

    :param action: the number of the argument that names the action; ``names`` and ``values`` likewise, None
        when the function has no such argument.
    :param rest: the number of the argument that takes all further ones; None when there is none.
    """

    action: int
    names: int | None
    values: int | None
    rest: int | None

    def argument(self, call: SyntaxNode, number: int | None) -> Values | None:
        """Return what an argument of a call is."""
        if number is None or number >= len(call.arguments):
            return () if number is not None and number == self.rest else None
        if number == self.rest:
            return call.arguments[number:]
        return written(call.arguments[number : number + 1])


def planned_actions(files: Iterable[ClipsFile]) -> Iterator[WrittenAction]:
    """Yield the actions whose names are written out."""
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
                yield WrittenAction(
                    file,
                    call.arguments[builder.action],
                    call,
                    builder.argument(call, builder.names) or None,  # an empty list: the operator has them
                    builder.argument(call, builder.values),
                )


def _of_fact(file: ClipsFile, fact: SyntaxNode) -> Iterator[WrittenAction]:
    slots = {item.head: item.arguments for item in fact.arguments if item.head}
    name = slots.get("action-name", ())
    if len(name) == 1 and literal(name[0]):
        names, values = slots.get("param-names"), slots.get("param-values")
        yield WrittenAction(
            file,
            name[0],
            fact,
            None if names is None else written(names),
            None if values is None else written(values),
        )


def _builders(file: ClipsFile) -> Iterator[tuple[str, _Builder]]:
    """Yield the functions that assert a plan-action whose name is one of their arguments."""
    for construct in file.constructs:
        if construct.kind != "deffunction":
            continue
        items = next((node.items for node in construct.node.arguments[1:3] if node.items is not None), ())
        parameters = [item.text for item in items]
        plain = [text.removeprefix("$") for text in parameters]

        def number(fact: SyntaxNode, slot: str, plain: list[str] = plain) -> int | None:
            values = next((item.arguments for item in fact.arguments if item.head == slot), ())
            text = values[0].text.removeprefix("$") if len(values) == 1 else ""
            return plain.index(text) if text in plain else None

        for fact in construct.node.walk():
            action = number(fact, "action-name") if fact.head == _FACT else None
            if action is not None:
                rest = next((n for n, text in enumerate(parameters) if text.startswith("$")), None)
                names, values = number(fact, "param-names"), number(fact, "param-values")
                yield construct.name, _Builder(action, names, values, rest)


def written(values: Values) -> Values | None:
    """Return the single values of a slot or an argument; None when some of them may be any number."""
    if len(values) == 1 and values[0].head == "create$":
        values = values[0].arguments
    elif len(values) == 1 and values[0].text.startswith("?"):
        return None
    return values


def count(values: Values) -> int | None:
    """Return how many values there are; None when one of them may be any number."""
    is_open = any(value.items is not None or value.text.startswith("$?") for value in values)
    return None if is_open else len(values)
