"""The LR parser for the tables of PDDL's grammar.

The parser pushes tokens onto three parallel stacks (states, values, start offsets). At the end of a grammar
rule, it replaces the values of the rule's right side by the value that the builder makes of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cxbridge.executive.pddl.grammar import END_TERMINAL, Rule, load_tables
from cxbridge.executive.pddl.tokens import Token

Build = Callable[[Any, list[Any], int], Any]
"""Makes the value of a rule: gets the builder, the values of the right side, and the start offset."""


class UnexpectedToken(Exception):  # noqa: N818  it never leaves this package
    """A token that the grammar does not permit at its place.

    :param expected: the permitted terminals; the names of permitted rules of the grammar, too.
    """

    def __init__(self, token: Token, expected: frozenset[str]) -> None:
        super().__init__(token)
        self.token = token
        self.expected = expected


class Reader:
    """Parses token lists.

    :param find_build: returns the function for a rule or alias of the grammar.
    """

    def __init__(self, find_build: Callable[[str], Build]) -> None:
        tables = load_tables()
        self._states = tables.states
        self._first_states = tables.starts
        self._rules = [(rule.size, rule.result, _make_reduction(rule, find_build)) for rule in tables.rules]

    def read(self, tokens: list[Token], symbol: str, builder: object) -> Any:
        """Return the value of a start symbol that matches all tokens.

        :param builder: the object that the functions of rules get.
        :raises UnexpectedToken: if the tokens do not match.
        """
        table, rules = self._states, self._rules
        state = self._first_states[symbol]
        states: list[int] = [state]
        values: list[Any] = []
        start_offsets: list[int] = []
        for token in tokens:
            kind, _, start = token
            # a negative step reduces by the rule with the number -1 - step; another step is the next state
            while (step := table[state].get(kind)) is not None and step < 0:
                size, result, reduce = rules[-1 - step]  # the size is never 0: lark removes empty rules
                rule_start = start_offsets[-size]
                value = reduce(builder, values[-size:], rule_start)
                del values[-size:], start_offsets[-size:], states[-size:]
                values.append(value)
                start_offsets.append(rule_start)
                state = table[states[-1]][result]
                states.append(state)
            if step is None:
                # the state after a complete start symbol has no steps at all
                if kind == END_TERMINAL and not table[state]:
                    break
                raise UnexpectedToken(token, frozenset(table[state]))
            state = step
            states.append(state)
            values.append(token)
            start_offsets.append(start)
        return values[0]


def _make_reduction(rule: Rule, find_build: Callable[[str], Build]) -> Build:
    """Return the function that makes a rule's value from all values on its right side."""
    value_indices, list_indices = rule.value_indices, set(rule.list_indices)
    if rule.result.startswith("__"):  # lark's rule for the list of a repeated part, such as ``condition*``
        return _append_value if list_indices else _keep_values
    if not rule.build and len(value_indices) == 1:
        (index,) = value_indices
        return lambda _builder, values, _start: values[index]
    build = find_build(rule.build) if rule.build else _keep_values
    # rules without lists are most frequent: their function does not test each index, to save time
    if not list_indices:
        return lambda builder, values, start: build(
            builder, [values[index] for index in value_indices], start
        )
    return lambda builder, values, start: build(
        builder,
        [
            value
            for index in value_indices
            for value in (values[index] if index in list_indices else (values[index],))
        ],
        start,
    )


def _keep_values(_builder: object, values: list[Any], _start: int) -> list[Any]:
    return values


def _append_value(_builder: object, values: list[Any], _start: int) -> list[Any]:
    items: list[Any]
    items, new_item = values
    items.append(new_item)
    return items
