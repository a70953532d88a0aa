"""Regular expressions of C++'s ``std::regex`` (ECMAScript, ignoring case), translated to :mod:`re`.

Fawkes' action mapping passes users' expressions to ``std::regex``. The few differences between the dialects
are translated, and invalid ECMAScript expressions are refused, including repeated repetitions such as
``a**``, which libstdc++ accepts. Sources: ECMA-262 5.1, section 15.10, and the behaviour of libstdc++.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache

_POSIX_CLASSES = {
    "alnum": "A-Za-z0-9",
    "alpha": "A-Za-z",
    "blank": r" \t",
    "digit": "0-9",
    "lower": "a-z",
    "punct": r"!-/:-@\[-`{-~",
    "space": r"\s",
    "upper": "A-Z",
    "xdigit": "0-9A-Fa-f",
}
# What means the same after a backslash in both dialects.
_SHARED_ESCAPES = frozenset("dDsSwWbB123456789tnrfv")

_QUANTIFIER = re.compile(r"[*+?]\??|\{\d+(?:,\d*)?\}\??")
_GROUP_START = re.compile(r"\((?!\?)|\(\?[:=!]")
_POSIX_CLASS = re.compile(r"\[:(\w+):\]")


class EcmaRegexError(ValueError):
    """The text is not an ECMAScript expression."""


class _Translator:
    """Translates one expression from left to right.

    :param pattern: the ECMAScript expression.
    """

    def __init__(self, pattern: str) -> None:
        self.pattern = pattern
        self.position = 0
        self.repeatable = False

    def translate(self) -> str:
        """Return the expression in the syntax of :mod:`re`."""
        parts: list[str] = []
        while self.position < len(self.pattern):
            parts.append(self._item())
        return "".join(parts)

    def _item(self) -> str:
        char = self.pattern[self.position]
        if char in "*+?{":
            return self._quantifier()
        self.repeatable = char not in "^|("
        if char == "\\":
            return self._escape(in_class=False)
        if char == "[":
            return self._char_class()
        if char == "(":
            return self._next_token(_GROUP_START, "a group that ECMAScript does not know")
        self.position += 1
        # in ECMAScript, '.' excludes all line ends, and '$' does not match before a final newline
        return {".": r"[^\n\r]", "$": r"\Z"}.get(char, char)

    def _quantifier(self) -> str:
        if not self.repeatable:
            raise EcmaRegexError(f"nothing to repeat at position {self.position + 1}")
        self.repeatable = False
        return self._next_token(_QUANTIFIER, "a repetition that ECMAScript does not know")

    def _next_token(self, token: re.Pattern[str], otherwise: str) -> str:
        found = token.match(self.pattern, self.position)
        if found is None:
            raise EcmaRegexError(f"{otherwise} at position {self.position + 1}")
        self.position = found.end()
        return found.group()

    def _escape(self, *, in_class: bool) -> str:
        char = self.pattern[self.position + 1 : self.position + 2]
        if not char:
            raise EcmaRegexError("a backslash at the end")
        self.position += 2
        if char in _SHARED_ESCAPES and not (in_class and char in "B123456789"):
            return "\\" + char
        if char == "0":
            return r"\x00"
        if char == "c":
            self.position += 1
            return re.escape(chr(ord(self.pattern[self.position - 1 : self.position] or "\0") % 32))
        if char in "xu":
            return self._code_point({"x": 2, "u": 4}[char])
        return re.escape(char)

    def _code_point(self, digits: int) -> str:
        code = self.pattern[self.position : self.position + digits]
        if len(code) != digits or not re.fullmatch(r"[0-9A-Fa-f]+", code):
            raise EcmaRegexError(f"{digits} hexadecimal digits are missing at position {self.position + 1}")
        self.position += digits
        return re.escape(chr(int(code, 16)))

    def _char_class(self) -> str:
        start = self.position
        self.position += 1
        negated = self.pattern.startswith("^", self.position)
        self.position += negated
        parts: list[str] = []
        while not self.pattern.startswith("]", self.position):
            if self.position >= len(self.pattern):
                raise EcmaRegexError(f"the '[' at position {start + 1} is never closed")
            parts.append(self._class_item())
        self.position += 1
        if not parts:  # [] matches nothing, [^] any character
            return r"[\s\S]" if negated else r"(?!)"
        return f"[{'^' if negated else ''}{''.join(parts)}]"

    def _class_item(self) -> str:
        posix = _POSIX_CLASS.match(self.pattern, self.position)
        if posix is not None:
            self.position = posix.end()
            try:
                return _POSIX_CLASSES[posix.group(1).lower()]
            except KeyError:
                raise EcmaRegexError(f"unknown character class '{posix.group(1)}'") from None
        char = self.pattern[self.position]
        if char == "\\":
            return self._escape(in_class=True)
        self.position += 1
        return "\\" + char if char in "[&~|" else char


@lru_cache(maxsize=256)
def compile_pattern(pattern: str) -> re.Pattern[str]:
    """Compile an ECMAScript expression, ignoring the case of ASCII letters.

    :raises EcmaRegexError: if the expression is invalid.
    """
    try:
        return re.compile(_Translator(pattern).translate(), re.IGNORECASE | re.ASCII)
    except (re.error, OverflowError) as error:
        raise EcmaRegexError(str(error)) from None


_Part = str | int | Callable[[re.Match[str], int], str]


@lru_cache(maxsize=256)
def _replacement_parts(template: str) -> tuple[_Part, ...]:
    """Split a replacement into texts, group numbers, and functions of the match."""
    parts: list[_Part] = []
    end = 0
    for found in re.finditer(r"\$(?:([$&`'])|([0-9]{1,2}))", template):
        parts.append(template[end : found.start()])
        end = found.end()
        sign, number = found.groups()
        if number is not None:
            parts.append(int(number))
        elif sign == "$":
            parts.append("$")
        elif sign == "&":
            parts.append(0)
        elif sign == "`":
            parts.append(lambda match, previous_end: match.string[previous_end : match.start()])
        else:
            parts.append(lambda match, _: match.string[match.end() :])
    parts.append(template[end:])
    return tuple(part for part in parts if part != "")


def replace_all(pattern: str, replacement: str, value: str) -> str:
    """Replace every match of ``pattern`` in ``value``, as ``std::regex_replace`` does.

    :param replacement: may contain ``$$``, ``$&``, ``$1`` to ``$99``, ``$``` (the text since the previous
        match) and ``$'``. A missing group is empty.
    :raises EcmaRegexError: if ``pattern`` is not an ECMAScript expression.
    """
    parts = _replacement_parts(replacement)
    previous_end = 0

    def expand(match: re.Match[str]) -> str:
        nonlocal previous_end
        texts = []
        for part in parts:
            if isinstance(part, str):
                texts.append(part)
            elif isinstance(part, int):
                texts.append((match.group(part) or "") if part <= match.re.groups else "")
            else:
                texts.append(part(match, previous_end))
        previous_end = match.end()
        return "".join(texts)

    return compile_pattern(pattern).sub(expand, value)
