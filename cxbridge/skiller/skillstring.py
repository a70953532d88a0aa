"""Skill strings as data: a reader of Lua code that consists of calls with literal arguments.

Receivers of foreign skill strings evaluate nothing; only the Lua Skiller in mode ``fawkes`` does. The grammar
is the part of Lua 5.1 without evaluation: ``f{...}``, ``f(...)``, ``f"text"``, ``f[[text]]``; strings with
all escapes and long brackets, signed numbers, ``true``, ``false``, ``nil``, tables of these, comments. The
tests compare the results with those of Lua 5.1.

The scanner is hand-written, because the first skill string must not delay a loop: importing lark and making
its parser takes 150 ms, reading a skill string 140 us.
"""

from __future__ import annotations

import math
import re
from typing import Any, Final, NamedTuple, NoReturn

from msgspec import Struct, field

from cxbridge.errors import SkillError
from cxbridge.skiller.lua.host import from_lua, to_lua

Value = str | float | int | bool | None | dict[Any, Any]
"""An argument: string, number, boolean, nil, or a table. Values without key have the keys 1, 2 and so on."""

MAX_DEPTH: Final = 50
"""The maximum nesting of tables."""

ONLY_FAWKES: Final = "only /skiller/mode: fawkes evaluates Lua"
"""The end of error messages about skill strings that need evaluation."""


class LuaCall(NamedTuple):
    """A call in a skill string, with its place.

    :param name: the called skill.
    :param values: the arguments.
    :param line: the line of the name, from 1.
    :param column: the column of the name in characters, from 1.
    """

    name: str
    values: tuple[Value, ...]
    line: int
    column: int


class _Token(NamedTuple):
    """A token of a skill string.

    :param kind: ``name``, ``number``, ``string``, ``symbol``, or ``end`` at the end of the skill string.
    :param value: the value of a number or a string.
    """

    kind: str
    text: str
    position: int
    value: Value = None


# as in Lua's scanner, a number takes all following letters and digits, so that 3x is one wrong number
_SCANNER: Final = re.compile(
    r"""(?P<blank>[ \t\r\n\f\v]+)
      | (?P<long>(?:--)?\[(?P<level>=*)\[)
      | (?P<comment>--[^\r\n]*)
      | (?P<name>[A-Za-z_][A-Za-z0-9_]*)
      | (?P<number>\.?[0-9][0-9.]*(?:[eE][+-]?)?[A-Za-z0-9_]*)
      | (?P<string>"(?:[^"\\\r\n]|\\(?:\r\n|\n\r|.))*"|'(?:[^'\\\r\n]|\\(?:\r\n|\n\r|.))*')
      | (?P<symbol>.)""",
    re.VERBOSE | re.DOTALL,
)
_NUMBER: Final = re.compile(r"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_HEXADECIMAL: Final = re.compile(r"0[xX][0-9a-fA-F]+")
_ESCAPE: Final = re.compile(r"\\(?:([0-9]{1,3})|(\r\n|\n\r|.))", re.DOTALL)
_ESCAPES: Final = {"n": "\n", "r": "\r", "t": "\t", "a": "\a", "b": "\b", "f": "\f", "v": "\v"}
_LINE_END: Final = re.compile(r"\r\n|\n\r|\r|\n")
_CONSTANTS: Final[dict[str, bool | None]] = {"nil": None, "true": True, "false": False}
_KEYWORDS: Final = frozenset(
    ["and", "break", "do", "else", "elseif", "end", "for", "function", "if", "in", "local", "not"]
) | {"or", "repeat", "return", "then", "until", "while"}
_REPLACEMENT: Final = "\N{REPLACEMENT CHARACTER}"
_MAX_EXCERPT_LENGTH: Final = 20  # the maximum number of characters of a token in an error


def read_calls(text: str) -> list[LuaCall]:
    """Return the calls in a skill string; empty for a text of blanks and comments.

    :raises SkillError: if the text is not a list of calls; the message names the place.
    """
    return _LuaCallReader(text).parse_calls()


class SkillStringCall(Struct, frozen=True):
    """A call of a skill.

    :param args: arguments by name, or by position from 1.
    """

    name: str
    args: dict[str | int, Any] = field(default_factory=dict)


def parse_skill_string(text: str) -> list[SkillStringCall]:
    """Return the calls in a skill string, at least one.

    :raises SkillError: if the text is not a list of calls, or has no call.
    """
    calls = read_calls(text)
    if not calls:
        raise SkillError("the skill string has no call of a skill")
    return [_to_skill_string_call(call) for call in calls]


def parse_skill_call(text: str) -> SkillStringCall:
    """Return the only call in a skill string.

    :raises SkillError: if the text is not a list of calls, or has no call or several calls.
    """
    calls = parse_skill_string(text)
    if len(calls) != 1:
        raise SkillError(f"the skill string '{text}' must have one call, not {len(calls)}")
    return calls[0]


def _to_skill_string_call(call: LuaCall) -> SkillStringCall:
    """Return a call with its arguments by name; arguments without names by position."""
    if len(call.values) == 1 and isinstance(call.values[0], dict):
        return SkillStringCall(call.name, call.values[0])
    return SkillStringCall(call.name, dict(enumerate(call.values, start=1)))


class _LuaCallReader:
    """Reads the calls in a skill string, token by token."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._position = 0
        self._depth = 0
        self._next_token = self._scan_token()

    def parse_calls(self) -> list[LuaCall]:
        calls = []
        while self._next_token.kind != "end":
            calls.append(self._parse_call())
            # a semicolon may end a call, as in Lua
            if self._next_token.text == ";" and self._next_token.kind == "symbol":
                self._take_token()
        return calls

    def _refuse(self, message: str, position: int) -> NoReturn:
        place = format_place(*_line_and_column(self._text, position))
        raise SkillError(
            f"{place}: {message}",
            hint="a skill string must consist of calls with literal arguments: name{key=1, other='text'}",
        )

    def _refuse_token(self, token: _Token, expected: str) -> NoReturn:
        if token.kind == "end":
            self._refuse(f"the skill string ends where {expected} should be", token.position)
        excerpt = "".join(
            char if char.isprintable() else _REPLACEMENT for char in token.text[:_MAX_EXCERPT_LENGTH]
        )
        self._refuse(f"'{excerpt}' stands where {expected} should be; {ONLY_FAWKES}", token.position)

    def _scan_token(self) -> _Token:
        while self._position < len(self._text):
            match = _SCANNER.match(self._text, self._position)
            assert match is not None  # the last alternative matches any character
            start, kind, text = self._position, str(match.lastgroup), match.group()
            self._position = match.end()
            if kind == "long":
                value = self._read_long_bracket(start, match["level"])
                if not text.startswith("-"):
                    return _Token("string", text, start, value)
            elif kind == "string":
                return _Token("string", text, start, self._unquote(text, start))
            elif kind == "number":
                return _Token("number", text, start, self._parse_number(text, start))
            elif kind not in ("blank", "comment"):
                if text in ('"', "'"):
                    self._refuse(f"the text that begins with {text} does not end in its line", start)
                return _Token(kind, text, start)
        return _Token("end", "", len(self._text))

    def _take_token(self) -> _Token:
        token, self._next_token = self._next_token, self._scan_token()
        return token

    def _is_symbol(self, symbol: str) -> bool:
        return self._next_token.kind == "symbol" and self._next_token.text == symbol

    def _expect(self, symbol: str, expected: str) -> None:
        if not self._is_symbol(symbol):
            self._refuse_token(self._next_token, expected)
        self._take_token()

    def _read_long_bracket(self, start: int, level: str) -> str:
        end = self._text.find(f"]{level}]", self._position)
        if end < 0:
            self._refuse(f"the long bracket has no end (]{level}])", start)
        # Lua 5.1 refuses a nested '[[', because 5.0 nested long brackets
        if not level and (nested := self._text.find("[[", self._position, end)) >= 0:
            self._refuse("a '[[' within [[...]] needs [=[...]=] around it", nested)
        content = _LINE_END.sub("\n", self._text[self._position : end])
        self._position = end + len(level) + 2
        return content.removeprefix("\n")

    def _unquote(self, quoted_text: str, start: int) -> str:
        content = quoted_text[1:-1]
        if "\\" not in content:
            return content
        has_byte_escape = False

        def unescape(match: re.Match[str]) -> str:
            nonlocal has_byte_escape
            if match[1] is None:
                return "\n" if match[2][0] in "\r\n" else _ESCAPES.get(match[2], match[2])
            code = int(match[1])
            if code > 255:  # noqa: PLR2004 - the largest byte
                self._refuse(f"'{match[0]}' is not a byte from 0 to 255", start + 1 + match.start())
            has_byte_escape |= code > 127  # noqa: PLR2004 - the last character of ASCII
            return chr(code)

        text = _ESCAPE.sub(unescape, content)
        # an escape is a byte rather than a character: several escapes may form one character
        return from_lua(_ESCAPE.sub(unescape, to_lua(content))) if has_byte_escape else text

    def _parse_number(self, text: str, start: int) -> int | float:
        if _HEXADECIMAL.fullmatch(text):
            # as in Lua, whose numbers are doubles; up to 2**53 each integer is a double
            integer = int(text, 16)
            return integer if integer < 2**53 else _as_float(integer)
        if not _NUMBER.fullmatch(text):
            self._refuse(f"'{text[:_MAX_EXCERPT_LENGTH]}' is not a number", start)
        number = float(text)
        return int(number) if number.is_integer() and number < 2**53 else number

    def _parse_call(self) -> LuaCall:
        name = self._take_token()
        if name.kind != "name" or name.text in _KEYWORDS or name.text in _CONSTANTS:
            self._refuse_token(name, "the name of a skill")
        values = self._parse_arguments(name)
        return LuaCall(name.text, values, *_line_and_column(self._text, name.position))

    def _parse_arguments(self, name: _Token) -> tuple[Value, ...]:
        if self._next_token.kind == "string":
            return (self._take_token().value,)
        if self._is_symbol("{"):
            return (self._parse_table(),)
        if not self._is_symbol("("):
            self._refuse_token(self._next_token, f"the arguments of '{name.text[:_MAX_EXCERPT_LENGTH]}'")
        # Lua 5.1 calls this ambiguous: the '(' may begin the next statement
        if _LINE_END.search(self._text, name.position, self._next_token.position):
            self._refuse("a '(' must be in the line of the name before it", self._next_token.position)
        self._take_token()
        values: list[Value] = []
        if not self._is_symbol(")"):
            values.append(self._parse_value())
            while self._is_symbol(","):
                self._take_token()
                values.append(self._parse_value())
        self._expect(")", "',' or ')'")
        return tuple(values)

    def _parse_value(self) -> Value:
        if self._is_symbol("{"):
            return self._parse_table()
        token = self._take_token()
        if token.kind in ("string", "number"):
            return token.value
        if token.kind == "name" and token.text in _CONSTANTS:
            return _CONSTANTS[token.text]
        if token.kind == "symbol" and token.text == "-" and self._next_token.kind == "number":
            number = self._take_token().value
            assert isinstance(number, int | float)
            return -number if number else -0.0  # Python has no negative integer zero
        return self._refuse_token(token, "a literal")

    def _parse_table(self) -> dict[Any, Any]:
        opening = self._take_token()
        self._depth += 1
        # each level calls this method again, and Python's stack is limited to 1000 calls by default
        if self._depth > MAX_DEPTH:
            self._refuse(f"tables are nested more than {MAX_DEPTH} deep", opening.position)
        table: dict[Any, Any] = {}
        positional_values: dict[int, Value] = {}
        while not self._is_symbol("}"):
            key, value = self._parse_field()
            if key is None:
                positional_values[len(positional_values) + 1] = value
            else:
                table[key] = value
            if self._is_symbol(",") or self._is_symbol(";"):
                self._take_token()
            elif not self._is_symbol("}"):
                self._refuse_token(self._next_token, "',' or '}'")
        self._take_token()
        self._depth -= 1
        # positional values override equal explicit keys, as in Lua
        return table | positional_values

    def _parse_field(self) -> tuple[str | float | None, Value]:
        if self._is_symbol("["):
            position = self._take_token().position
            key = self._parse_value()
            if not isinstance(key, str | int | float) or isinstance(key, bool):
                self._refuse("a key must be a word, a string or a number", position)
            self._expect("]", "']'")
            self._expect("=", "'='")
            return key, self._parse_value()
        if self._next_token.kind == "name" and self._next_token.text not in _CONSTANTS:
            name = self._take_token()
            if not self._is_symbol("=") or name.text in _KEYWORDS:
                self._refuse_token(name, "a literal")
            self._take_token()
            return name.text, self._parse_value()
        return None, self._parse_value()


def format_place(line: int, column: int) -> str:
    """Return a place in a skill string for messages; the only line of most skill strings is left out."""
    return f"column {column}" if line == 1 else f"line {line}, column {column}"


def _line_and_column(text: str, position: int) -> tuple[int, int]:
    """Return line and column of a position."""
    line, line_start = 1, 0
    for end in _LINE_END.finditer(text, 0, position):
        line, line_start = line + 1, end.end()
    return line, position - line_start + 1


def _as_float(integer: int) -> float:
    try:
        return float(integer)
    except OverflowError:
        return math.inf
