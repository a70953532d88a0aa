"""Skill strings of the usual form, ``name{key=value, ...}`` or ``name(value, ...)``, as values.

A skill string may be any Lua chunk; this reads those that are calls with constant arguments, one or more in a
row. That is what action mappings make, and all that a simulator or a viewer can know without running Lua.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from cxbridge.errors import SkillError

if TYPE_CHECKING:
    from lark import Lark

_GRAMMAR = r"""
    start: (call ";"?)+
    call: NAME (table | "(" [_args] ")" | STRING)
    _args: value ("," value)*
    table: "{" [_field (_sep _field)* _sep?] "}"
    _sep: "," | ";"
    _field: pair | value
    pair: (NAME | "[" (STRING | NUMBER) "]") "=" value
    value: STRING | NUMBER | NAME | table

    NAME: /[A-Za-z_][A-Za-z0-9_]*/
    NUMBER: /-?(0[xX][0-9a-fA-F]+|([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?)/
    STRING: /"(\\(.|\n)|[^"\\\n])*"/ | /'(\\(.|\n)|[^'\\\n])*'/
    COMMENT: /--[^\n]*/
    %import common.WS
    %ignore WS
    %ignore COMMENT
"""

Value = str | float | int | bool | None | dict[Any, Any]
"""An argument: text, number, truth value, nil, a table, or the name of a variable as :class:`Name`."""


@dataclass(frozen=True, slots=True)
class Name:
    """A variable in a skill string; its value is known to Lua only."""

    name: str


@dataclass(frozen=True, slots=True)
class SkillCall:
    """A call of a skill.

    :param name: the skill.
    :param args: its arguments by name; those without one by their position, from 1.
    """

    name: str
    args: dict[str | int, Any] = field(default_factory=dict)


@lru_cache(maxsize=1)
def _parser() -> Lark:
    from lark import Lark  # noqa: PLC0415 - only who looks into skill strings pays for it

    return Lark(_GRAMMAR, parser="lalr", maybe_placeholders=False)


def parse_skill_string(text: str) -> list[SkillCall]:
    """Return the calls in a skill string, in order.

    :raises SkillError: when it is not of the usual form, with line and column.
    """
    from lark import UnexpectedInput  # noqa: PLC0415
    from lark.exceptions import UnexpectedEOF  # noqa: PLC0415

    try:
        tree = _parser().parse(text)
    except UnexpectedInput as error:
        ended = (
            isinstance(error, UnexpectedEOF) or getattr(getattr(error, "token", None), "type", "") == "$END"
        )
        shown = (
            "it ends too early" if ended else f"'{text[error.pos_in_stream :][:20]}' does not belong there"
        )
        raise SkillError(
            f"cannot read the skill string '{text}': {shown}",
            line=None if ended else error.line,
            column=None if ended else error.column,
            hint="the usual form is name{key=value, other='text'}",
        ) from None
    return [_call(item) for item in tree.children]


def parse_skill_call(text: str) -> SkillCall:
    """Return the one call in a skill string.

    :raises SkillError: when it is not of the usual form, or has several calls.
    """
    calls = parse_skill_string(text)
    if len(calls) != 1:
        raise SkillError(f"the skill string '{text}' has {len(calls)} calls, expected one")
    return calls[0]


_FAWKES_CALL = re.compile(r"(\w+)(?:\(\)|\{(.+)?\})", re.ASCII)
_FAWKES_ARGS = re.compile(r"(?:([^,]+),\s*)*?([^,]+)")
_FAWKES_ARG = re.compile(r"""(\w+)=(['"]?)([^'"]*)\2\s*""", re.ASCII)


def parse_as_fawkes(text: str) -> SkillCall:
    """Return the call in a skill string as Fawkes' simulator reads it.

    All values are texts, of several arguments the last two are seen, and one with a comma or a quote is lost.

    :raises SkillError: when it is neither ``name()`` nor ``name{...}``.
    """
    line = text.replace("\n", "")
    found = _FAWKES_CALL.fullmatch(line)
    if found is None:
        raise SkillError(f"Unexpected skill string: '{line}'")
    args: dict[str | int, Any] = {}
    seen = _FAWKES_ARGS.fullmatch(found[2] or "")
    for item in seen.groups() if seen else ():
        pair = _FAWKES_ARG.fullmatch(item or "")
        if pair is not None:
            args[pair[1]] = pair[3]
    return SkillCall(found[1], args)


def _call(tree: Any) -> SkillCall:
    name, *rest = tree.children
    if len(rest) == 1 and getattr(rest[0], "data", "") == "table":
        return SkillCall(str(name), _table(rest[0]))
    return SkillCall(str(name), {position: _value(item) for position, item in enumerate(rest, start=1)})


def _table(tree: Any) -> dict[str | int, Any]:
    args: dict[str | int, Any] = {}
    position = 0
    for item in tree.children:
        if item.data == "pair":
            key, value = item.children
            args[str(key) if key.type == "NAME" else _constant(key)] = _value(value)
        else:
            position += 1
            args[position] = _value(item)
    return args


def _value(tree: Any) -> Any:
    item = tree.children[0] if hasattr(tree, "children") else tree
    return _table(item) if hasattr(item, "children") else _constant(item)


def _constant(token: Any) -> Any:
    if token.type == "STRING":
        return _unquote(str(token)[1:-1])
    if token.type == "NUMBER":
        return _number(str(token))
    return {"nil": None, "true": True, "false": False}.get(str(token), Name(str(token)))


def _number(text: str) -> int | float:
    if "x" in text.lower():
        return int(text, 16)
    number = float(text)
    return int(number) if number.is_integer() and abs(number) < 2**53 else number


_ESCAPES = {"n": "\n", "r": "\r", "t": "\t", "a": "\a", "b": "\b", "f": "\f", "v": "\v"}


def _unquote(text: str) -> str:
    """Undo Lua's escapes."""
    parts: list[str] = []
    position = 0
    while position < len(text):
        char = text[position]
        position += 1
        if char != "\\":
            parts.append(char)
            continue
        digits = 0
        while digits < 3 and text[position + digits : position + digits + 1].isdecimal():  # noqa: PLR2004
            digits += 1
        if digits:
            parts.append(chr(int(text[position : position + digits]) & 0xFF))
            position += digits
        else:
            parts.append(_ESCAPES.get(text[position], text[position]))
            position += 1
    return "".join(parts)
