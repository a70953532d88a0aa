"""Templates of skill strings: text with placeholders ``?(NAME)T`` and ``?(NAME|/PATTERN/REPLACEMENT/|...)T``.

The grammar is the one of Fawkes' action mapping: whatever is not exactly a placeholder is text.
:func:`find_doubts` says where a text was probably meant to be one.
"""

from __future__ import annotations

import re
from functools import lru_cache

from msgspec import Struct

_PLACEHOLDER = re.compile(r"\?\((?P<name>[A-Za-z0-9_-]+)(?P<chain>(?:\|/[^/]+/[^/]+/)*)\)(?P<kind>[sSyYif])")


class Replacement(Struct, frozen=True):
    """A step of a placeholder's chain: replace what ``pattern`` matches."""

    pattern: str
    replacement: str


class Misfit(Struct, frozen=True):
    """A step of a chain that Fawkes ignores with a warning."""

    warning: str


class Placeholder(Struct, frozen=True):
    """A place in a template where a parameter's value goes.

    :param name: the parameter.
    :param steps: the chain of replacements, in order.
    :param kind: one of ``s S y Y i f``.
    """

    name: str
    steps: tuple[Replacement | Misfit, ...]
    kind: str


Part = str | Placeholder
"""A piece of a template: literal text or a placeholder."""


class Doubt(Struct, frozen=True):
    """A text that looks like a placeholder and is none.

    :param offset: where it starts in the template, from 0.
    :param text: its beginning.
    :param reason: why it is none, and what would be one.
    """

    offset: int
    text: str
    reason: str


@lru_cache(maxsize=1024)
def parse_template(template: str) -> tuple[Part, ...]:
    """Split a template into its parts. Every text is a template, so this never fails."""
    parts: list[Part] = []
    end = 0
    for found in _PLACEHOLDER.finditer(template):
        if found.start() > end:
            parts.append(template[end : found.start()])
        # Fawkes splits at every bar, also inside of a pattern: alternatives cannot be written.
        steps = tuple(_step(piece) for piece in found["chain"].split("|") if piece)
        parts.append(Placeholder(found["name"], steps, found["kind"]))
        end = found.end()
    if end < len(template):
        parts.append(template[end:])
    return tuple(parts)


def _step(piece: str) -> Replacement | Misfit:
    if not (len(piece) > 2 and piece[0] == piece[-1] == "/"):  # noqa: PLR2004
        return Misfit(f"regex '{piece}' missing start/end slashes, ignoring")
    pattern, slash, replacement = piece[1:-1].partition("/")
    if not slash:
        return Misfit(f" regex '{piece}' missing mid slash, ignoring")
    return Replacement(pattern, replacement)


def find_doubts(template: str) -> list[Doubt]:
    """Return every text in ``template`` that was probably meant to be a placeholder."""
    doubts = []
    offset = 0
    for part in parse_template(template):
        if isinstance(part, Placeholder):
            # Its length is not kept: find its end again, which is where the pattern found it.
            offset = _PLACEHOLDER.match(template, offset).end()  # type: ignore[union-attr]
            continue
        for found in re.finditer(r"\?\(", part):
            start = offset + found.start()
            doubts.append(Doubt(start, _excerpt(template[start:]), _reason(template[start:])))
        offset += len(part)
    return doubts


_EXCERPT_LENGTH = 40


def _excerpt(text: str) -> str:
    """Return the first few characters of ``text``, to the ')' and what follows it where that is near."""
    closing = text.find(")", 0, _EXCERPT_LENGTH)
    return text[: closing + 2] if closing >= 0 else text[:_EXCERPT_LENGTH]


def _reason(text: str) -> str:
    """Say why ``text``, which starts with ``?(``, is not a placeholder."""
    name = re.match(r"\?\(([A-Za-z0-9_-]*)", text)
    rest = text[name.end() :] if name else ""
    if name is None or not name.group(1):
        return "the name of a parameter is missing after '?('"
    if rest.startswith(")"):
        kind = rest[1:2]
        return f"the type {f'{kind!r} ' if kind else ''}after ')' is not one of s, S, y, Y, i, f"
    if rest.startswith("|"):
        if "//" in rest.partition(")")[0]:
            return "a pattern and its replacement must not be empty: |/PATTERN/REPLACEMENT/"
        return "the part after '|' is not /PATTERN/REPLACEMENT/ followed by ')' and a type"
    if not rest:
        return "the ')' is missing"
    return f"the character {rest[0]!r} cannot be part of a parameter's name"
