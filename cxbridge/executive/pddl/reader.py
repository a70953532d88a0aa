"""Follows the tables of PDDL's grammar through the tokens of a text. The grammar is ``pddl.lark``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cxbridge.executive.pddl.grammar import END, Rule, load_tables
from cxbridge.executive.pddl.tokens import Token

Build = Callable[[Any, list[Any], int], Any]
"""A method that makes the value of a rule of the values of its parts, and the place where it starts."""


class UnexpectedToken(Exception):  # noqa: N818  it never leaves this package
    """A token that cannot stand where it stands.

    :param expected: the terminals that could.
    """

    def __init__(self, token: Token, expected: frozenset[str]) -> None:
        super().__init__(token)
        self.token = token
        self.expected = expected


class Reader:
    """Reads texts of the grammar.

    :param builder: the class that has a method, a :data:`Build`, for each rule and alias of the grammar.
    """

    def __init__(self, builder: type) -> None:
        tables = load_tables()
        self._states = tables.states
        self._starts = tables.starts
        self._rules = [(rule.size, rule.result, _reduce(rule, builder)) for rule in tables.rules]

    def read(self, tokens: list[Token], symbol: str, builder: object) -> Any:
        """Return the value of a start symbol, which all tokens must be.

        :param builder: an instance of the reader's builder, for this text.
        :raises UnexpectedToken: when they are not.
        """
        table, rules = self._states, self._rules
        state = self._starts[symbol]
        states: list[int] = [state]
        values: list[Any] = []
        starts: list[int] = []
        for token in tokens:
            kind, _, start = token
            while (step := table[state].get(kind)) is not None and step < 0:
                size, result, reduce = rules[-1 - step]
                at = starts[-size]
                value = reduce(builder, values[-size:], at)
                del values[-size:], starts[-size:], states[-size:]
                values.append(value)
                starts.append(at)
                state = table[states[-1]][result]
                states.append(state)
            if step is None:
                if kind == END and not table[state]:
                    break
                raise UnexpectedToken(token, frozenset(table[state]))
            state = step
            states.append(state)
            values.append(token)
            starts.append(start)
        return values[0]


def _reduce(rule: Rule, builder: type) -> Build:
    """Return the function that makes the value of a rule from all values on its right side."""
    kept, spread = rule.kept, set(rule.spread)
    if rule.result.startswith("__"):  # a list of lark's, for a part that is repeated
        return _append if spread else _first
    if not rule.build and len(kept) == 1:
        (only,) = kept
        return lambda _builder, parts, _at: parts[only]
    build: Build = getattr(builder, rule.build) if rule.build else _first
    if not spread:
        return lambda builder, parts, at: build(builder, [parts[place] for place in kept], at)
    *ahead, last = kept
    if spread == {last}:
        return lambda builder, parts, at: build(
            builder, [*(parts[place] for place in ahead), *parts[last]], at
        )
    return lambda builder, parts, at: build(
        builder,
        [each for place in kept for each in (parts[place] if place in spread else (parts[place],))],
        at,
    )


def _first(_builder: object, parts: list[Any], _at: int) -> list[Any]:
    return parts


def _append(_builder: object, parts: list[Any], _at: int) -> list[Any]:
    items: list[Any] = parts[0]
    items.append(parts[1])
    return items
