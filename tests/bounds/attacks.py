"""Texts on which a regular expression backtracks, derived from the expression."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from re import _constants as codes
from re import _parser
from typing import Any

MANY = 32
"""A repeat up to this count is bounded by itself."""

_BACKTRACKING = (codes.MAX_REPEAT, codes.MIN_REPEAT)
_REPEATS = (*_BACKTRACKING, codes.POSSESSIVE_REPEAT)
_PROBES = [chr(code) for code in (*range(97, 100), *range(48, 51), *range(32, 127), 9, 10, 13, 0, 0xE9)]
_CATEGORY = {codes.CATEGORY_DIGIT: r"\d", codes.CATEGORY_SPACE: r"\s", codes.CATEGORY_WORD: r"\w"}
_CATEGORY |= {
    codes.CATEGORY_NOT_DIGIT: r"\D",
    codes.CATEGORY_NOT_SPACE: r"\S",
    codes.CATEGORY_NOT_WORD: r"\W",
}


def _in_set(item: Any, char: str) -> bool:
    code, value = item
    if code is codes.LITERAL:
        return bool(ord(char) == value)
    if code is codes.RANGE:
        return bool(value[0] <= ord(char) <= value[1])
    return re.match(_CATEGORY[value], char) is not None if code is codes.CATEGORY else False


def chars_of(node: Any) -> str:
    """Return the probe characters that a node of one character matches."""
    code, value = node
    if code is codes.ANY:
        return "".join(char for char in _PROBES if char != "\n")
    if code is codes.LITERAL:
        return chr(value)
    if code is codes.NOT_LITERAL:
        return "".join(char for char in _PROBES if ord(char) != value)
    negated = value[0][0] is codes.NEGATE
    return "".join(char for char in _PROBES if any(_in_set(item, char) for item in value) != negated)


def examples(nodes: Any, prefer: str, depth: int = 0) -> list[str]:
    """Return some texts that a sequence of nodes matches, of preferred characters where possible."""
    texts = [""]
    for code, value in nodes:
        options = _of_node(code, value, prefer, depth)
        texts = [text + option for text in texts for option in options][:12]
    return texts


def _of_node(code: Any, value: Any, prefer: str, depth: int) -> list[str]:
    if code in (codes.LITERAL, codes.NOT_LITERAL, codes.ANY, codes.IN):
        possible = chars_of((code, value))
        return [prefer if prefer in possible else possible[:1]]
    if code is codes.BRANCH:
        return [text for branch in value[1] for text in examples(branch, prefer, depth + 1)[:2]]
    if code in _REPEATS:
        return [text * max(value[0], 1) for text in examples(value[2], prefer, depth + 1)[:3]]
    if code in (codes.SUBPATTERN, codes.ATOMIC_GROUP):
        (part,) = _parts(code, value)
        return examples(part, prefer, depth + 1)
    return [""]


def _parts(code: Any, value: Any) -> list[Any]:
    """Return the expressions within a node."""
    if code is codes.BRANCH:
        return list(value[1])
    if code is codes.ATOMIC_GROUP:
        return [value]
    place = {codes.SUBPATTERN: 3, codes.ASSERT: 1, codes.ASSERT_NOT: 1} | dict.fromkeys(_REPEATS, 2)
    return [value[place[code]]] if code in place else []


def _literals(nodes: Any) -> Iterator[str]:
    """Yield the characters of an expression, also those of its sets."""
    for code, value in nodes:
        if code in (codes.LITERAL, codes.NOT_LITERAL):
            yield chr(value)
        for part in [value] if code is codes.IN else _parts(code, value):
            yield from _literals(part)


def repeats(nodes: Any, before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every repeat without a small bound, also nested, with a text that leads to the repeat."""
    for code, value in nodes:
        if code in _BACKTRACKING and value[1] > MANY:
            yield before, value[2]
        for part in _parts(code, value):
            yield from repeats(part, before)
        before += _of_node(code, value, "a", 0)[0]


def attacks(pattern: str | bytes, flags: int) -> Iterator[tuple[str, str, str]]:
    """Yield a beginning, a text to repeat, and an end on which the expression fails."""
    text = pattern.decode("latin-1") if isinstance(pattern, bytes) else pattern
    parsed = _parser.parse(text, flags & ~(re.UNICODE if isinstance(pattern, bytes) else 0))
    found = list(repeats(parsed))
    literals = sorted(set(_literals(parsed)))[:12]
    preferred = {*literals, "a", "0", " "}
    ends = ["\0", "\n!", "", *literals]
    seen: set[tuple[str, str, str]] = set()
    for before, body in found:
        for prefer in sorted(preferred):
            for pump in examples(body, prefer)[:4]:
                for end in ends:
                    attack = (before, pump, end)
                    if pump and attack not in seen:
                        seen.add(attack)
                        yield attack
                if before and (attack := ("", before + pump, "\0")) not in seen:
                    seen.add(attack)
                    yield attack


def seconds(pattern: re.Pattern[Any], method: str, text: str) -> float:
    """Return the processor time of a match."""
    subject: Any = text.encode("latin-1", "replace") if isinstance(pattern.pattern, bytes) else text
    call = getattr(pattern, method)
    began = time.thread_time()
    if method in ("sub", "subn"):
        call("", subject)
    elif method == "finditer":
        for _ in call(subject):
            pass
    else:
        call(subject)
    return time.thread_time() - began
