"""Regular expressions of C++'s ``std::regex`` (ECMAScript, ignoring case), translated to :mod:`re`.

Fawkes' action mapping passes users' expressions to ``std::regex``. The few differences between the dialects
are translated, and invalid ECMAScript expressions are refused, including repeated repetitions such as
``a**``, which libstdc++ accepts. Sources: ECMA-262 5.1, section 15.10, and the behaviour of libstdc++.
"""

from __future__ import annotations

import re
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

# the characters that have the same meaning after a backslash in both dialects
_SHARED_ESCAPES = frozenset("dDsSwWbB123456789tnrfv")

_ESCAPE = r"\\(?:c.|x[0-9A-Fa-f]{2}|u[0-9A-Fa-f]{4}|[^cxu])"
_TOKEN = re.compile(
    rf"""(?P<class>\[\^?(?:\[:\w+:\]|{_ESCAPE}|[^\]\\])*\])
      | (?P<escape>{_ESCAPE})
      | (?P<quantifier>[*+?]\??|\{{\d+(?:,\d*)?\}}\??)
      | (?P<group>\((?!\?)|\(\?[:=!])
      | (?P<character>[^\\\[*+?{{(])""",
    re.VERBOSE | re.DOTALL,
)
_CLASS_ITEM = re.compile(rf"\[:(\w+):\]|({_ESCAPE})|[\[&~|]", re.DOTALL)

_SYNTAX_MISTAKES = {
    "\\": "an invalid escape",
    "[": "a '[' that is never closed",
    "(": "a group that ECMAScript does not support",
    "{": "a repetition that ECMAScript does not support",
}
"""The mistake that each character shows if no token starts with it."""

# in ECMAScript '.' excludes all line ends, and '$' does not match before a final newline
_CHARACTERS = {".": r"[^\n\r]", "$": r"\Z"}

_REFERENCE = re.compile(r"\$(?:([$&`'])|([0-9]{1,2}))")


class EcmaRegexError(ValueError):
    """The text is not an ECMAScript expression."""


@lru_cache(maxsize=256)
def compile_pattern(pattern: str) -> re.Pattern[str]:
    """Compile an ECMAScript expression, ignoring the case of ASCII letters.

    :raises EcmaRegexError: if the expression is invalid.
    """
    try:
        return re.compile(_translate(pattern), re.IGNORECASE | re.ASCII)
    except (re.error, OverflowError) as error:
        raise EcmaRegexError(str(error)) from None


def replace_all(pattern: str, replacement: str, value: str) -> str:
    """Replace every match of ``pattern`` in ``value``, as ``std::regex_replace`` does.

    :param replacement: may contain ``$$``, ``$&``, ``$1`` to ``$99``, ``$``` (the text since the previous
        match) and ``$'``. A missing group is empty.
    :raises EcmaRegexError: if ``pattern`` is not an ECMAScript expression.
    """
    previous_end = 0

    def expand(match: re.Match[str]) -> str:
        nonlocal previous_end
        texts = {
            "$": "$",
            "&": match[0],
            "`": match.string[previous_end : match.start()],
            "'": match.string[match.end() :],
        }

        def referenced_text(reference: re.Match[str]) -> str:
            sign, number = reference.groups()
            if number is None:
                return texts[sign]
            return (match[int(number)] or "") if int(number) <= match.re.groups else ""

        previous_end = match.end()
        return _REFERENCE.sub(referenced_text, replacement)

    return compile_pattern(pattern).sub(expand, value)


def _translate(pattern: str) -> str:
    """Return an ECMAScript expression in the syntax of :mod:`re`."""
    texts: list[str] = []
    position = 0
    is_repeatable = False
    while position < len(pattern):
        token = _TOKEN.match(pattern, position)
        if token is None:
            raise EcmaRegexError(f"{_SYNTAX_MISTAKES[pattern[position]]} at position {position + 1}")
        kind, text = token.lastgroup, token.group()
        if kind == "quantifier" and not is_repeatable:
            raise EcmaRegexError(f"nothing to repeat at position {position + 1}")
        is_repeatable = kind in ("class", "escape") or (kind == "character" and text not in "^|")
        if kind == "class":
            text = _translate_class(text)
        elif kind == "escape":
            text = _translate_escape(text)
        elif kind == "character":
            text = _CHARACTERS.get(text, text)
        texts.append(text)
        position = token.end()
    return "".join(texts)


def _translate_class(text: str) -> str:
    """Return a character class in the syntax of :mod:`re`."""
    # re refuses the empty classes of ECMAScript: [] matches no character, [^] any character
    if text in ("[]", "[^]"):
        return "(?!)" if text == "[]" else r"[\s\S]"

    def translate_item(match: re.Match[str]) -> str:
        name, escape = match.groups()
        if name is not None and name not in _POSIX_CLASSES:
            raise EcmaRegexError(f"unknown character class '{name}'")
        if name is not None:
            return _POSIX_CLASSES[name]
        return _translate_escape(escape, in_class=True) if escape else f"\\{match[0]}"

    start = 2 if text.startswith("[^") else 1
    return text[:start] + _CLASS_ITEM.sub(translate_item, text[start:-1]) + "]"


def _translate_escape(escape: str, *, in_class: bool = False) -> str:
    """Return an escape sequence in the syntax of :mod:`re`."""
    char = escape[1]
    # in a class, ECMAScript takes \B and \1 for the characters themselves, which re refuses or reads as octal
    if char in _SHARED_ESCAPES and not (in_class and char in "B123456789"):
        return escape
    if char == "0":  # re would read the following digits as an octal number
        return r"\x00"
    if char == "c":
        return re.escape(chr(ord(escape[2]) % 32))  # \cJ: the control character of a letter
    digits = escape[2:]
    return re.escape(chr(int(digits, 16)) if char in "xu" else char)
