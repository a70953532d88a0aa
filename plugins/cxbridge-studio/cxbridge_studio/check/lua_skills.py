"""Finds mistakes in the text of a Lua skill that keep it from loading, or make a call fail.

The skill is not executed: only names that the text has as literals are compared, and no finding is about a
computed name.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from typing import Final

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.lua_tokens import Token, read_table, read_tokens

SkillMistake = tuple[int, str, str]
"""The offset of a mistake, the message and the hint, which may be empty."""

INTERFACE_METHODS: Final = frozenset(
    {"msgq_enqueue", "msgq_enqueue_copy", "msgq_first", "msgq_empty", "msgq_size", "msgq_pop", "msgq_flush"}
    | {"msgq_remove", "msgq_lock", "msgq_try_lock", "msgq_unlock", "read", "write", "timestamp", "serial"}
    | {"oftype", "has_writer", "num_readers", "changed", "refreshed", "is_writer", "type", "id", "uid"}
    | {"mem_serial", "create_message"}
)
"""The methods of each interface in Lua, besides the methods of its fields."""

# An entry such as `hand = hand`, of a closure, binds the name to the same value, so it does not count.
# Repetitions before a required sign are bounded, possessive or of one word: the time for a text is linear.
_BINDING: Final = re.compile(
    r"\b(?:local|for)[ \t]++(?!function)([\w \t,]+)"
    r"|\bfunction\b[^()]{0,99}\(([^)]{0,999})\)"
    r"|\b(\w+)\s*+=\s*+(?!=|\3\b)"
)
# The keys of conditions in a transition of a skill's state machine, as in Fawkes' hsm.lua.
_CONDITION_KEYS: Final = frozenset({"cond", "precond", "cond_and_precond"})


def find_load_mistakes(
    text: str, find_schema: Callable[[str], InterfaceSchema] | None = None
) -> Iterator[SkillMistake]:
    """Yield the mistakes that keep a skill from loading.

    :param find_schema: returns the schema of an interface type, or raises InterfaceError; None to skip the
        check of interfaces.
    """
    tokens = read_tokens(text)
    # A Lua module calls module(), or returns its table.
    if not any(token.text in {"module", "return"} for token in tokens):
        state = "makes no Lua module" if tokens else "is empty"
        yield 0, f"the file {state}, so there is no skill", "begin it with module(..., skillenv.module_init)"
        return
    if find_schema is not None:
        for type_token in _find_dependencies(tokens).values():
            try:
                find_schema(type_token.literal or "")
            except InterfaceError as error:
                yield type_token.offset, error.message, error.hint or ""


def find_unknown_methods(text: str, find_schema: Callable[[str], InterfaceSchema]) -> Iterator[SkillMistake]:
    """Yield the calls of methods that the interfaces of a skill lack, in code and in conditions."""
    tokens = read_tokens(text)
    bound_names = _find_bound_names(text)
    types_with_methods: dict[str, tuple[str, frozenset[str]]] = {}  # by variable
    for variable, type_token in _find_dependencies(tokens).items():
        if variable not in bound_names:
            try:
                schema = find_schema(type_token.literal or "")
            except InterfaceError:
                continue
            types_with_methods[variable] = (schema.name, _list_methods(schema))
    for variable, method in _find_method_calls(tokens):
        type_name, method_names = types_with_methods.get(variable, ("", frozenset()))
        if type_name and method.text not in method_names:
            hint = (
                did_you_mean(method.text, method_names)
                or f"it has: {', '.join(sorted(method_names - INTERFACE_METHODS))}"
            )
            yield method.offset, f"{type_name} has no method '{method.text}'", hint


def _list_methods(schema: InterfaceSchema) -> frozenset[str]:
    """Return the names that a call on an interface may use in Lua: methods, accessors and message classes."""
    names = {message.name for message in schema.messages}
    for field in schema.fields:
        prefixes = ("", "set_", "maxlenof_", *(["is_"] if field.storage.python_type is bool else []))
        names |= {f"{prefix}{field.name}" for prefix in prefixes}
    return INTERFACE_METHODS | names


def _find_method_calls(tokens: Sequence[Token]) -> Iterator[tuple[str, Token]]:
    """Yield the variable and the method of each call, in code and in conditions, which are strings."""
    for index, token in enumerate(tokens):
        earlier_tokens, later_tokens = tokens[max(index - 2, 0) : index], tokens[index + 1 : index + 4]
        previous_text = earlier_tokens[-1].text if earlier_tokens else ""
        # A condition follows `cond =`, or is an item of a transition: {STATE, TARGET, CONDITION}.
        if token.literal is not None and (
            previous_text == "," or (previous_text == "=" and earlier_tokens[0].text in _CONDITION_KEYS)
        ):
            for variable, method in _find_method_calls(read_tokens(token.literal)):
                # The text of the condition begins after the quote.
                yield variable, Token(method.kind, method.text, token.offset + 1 + method.offset)
        # The later tokens of a call are a colon, the method and a parenthesis: VARIABLE:METHOD(
        is_call = token.kind == "name" and [neighbour.text for neighbour in later_tokens[::2]] == [":", "("]
        if is_call and previous_text not in {".", ":"}:
            yield token.text, later_tokens[1]


def _find_bound_names(text: str) -> set[str]:
    """Return the names that the text binds: local variables, parameters, loop variables, assigned names."""
    groups = (group for match in _BINDING.finditer(text) for group in match.groups(""))
    return {name for group in groups for name in re.findall(r"\w+", group)}


def _find_dependencies(tokens: Sequence[Token]) -> dict[str, Token]:
    """Return the token with the interface type of each variable in ``depends_interfaces``.

    Entries with a computed variable or type are left out.
    """
    dependencies: dict[str, Token] = {}
    for index, token in enumerate(tokens[:-2]):
        if token.text != "depends_interfaces" or token.depth or tokens[index + 1].text != "=":
            continue
        table = read_table(tokens[index + 2 :])
        for item in [] if table is None else table.items:
            dependency = read_table(item)
            if dependency is None:
                continue
            variable, type_token = (_find_literal_token(dependency.fields.get(key)) for key in ("v", "type"))
            if variable is not None and type_token is not None:
                dependencies[variable.literal or ""] = type_token
    return dependencies


def _find_literal_token(value: Sequence[Token] | None) -> Token | None:
    """Return the token of a value that is only a string; None for any other value."""
    return value[0] if value and len(value) == 1 and value[0].literal is not None else None
