"""Templates of skill strings: text with placeholders such as ``?(name)s``. The grammar is ``templates.lark``.

:func:`find_suspected_placeholders` finds texts that resemble placeholders.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache, lru_cache
from pathlib import Path
from typing import Final

import msgspec
from msgspec import Struct

GRAMMAR: Final = Path(__file__).with_name("templates.lark")
TERMINALS: Final = Path(__file__).with_name("templates.json")


@cache
def _load_terminals() -> dict[str, re.Pattern[str]]:
    """Return the regular expression of each terminal of the grammar."""
    # a test keeps the file equal to the grammar: reading the grammar with lark would delay the start
    texts = msgspec.json.decode(TERMINALS.read_bytes(), type=dict[str, str])
    return {name: re.compile(text) for name, text in texts.items()}


class Replacement(Struct, frozen=True):
    """A step of a placeholder that replaces the matches of ``pattern``."""

    pattern: str
    replacement: str


class Misfit(Struct, frozen=True):
    """A step that Fawkes ignores with a warning."""

    warning: str


class Placeholder(Struct, frozen=True):
    """A placeholder for a parameter's value.

    :param name: the name of the parameter.
    :param kind: ``s`` and ``S`` put the value in quotes, ``y`` and ``Y`` do not, ``S`` and ``Y``
        convert it to upper case; ``i`` is an integer, ``f`` a float.
    """

    name: str
    steps: tuple[Replacement | Misfit, ...]
    kind: str


Part = str | Placeholder
"""A part of a template: literal text or a placeholder."""


class SuspectedPlaceholder(Struct, frozen=True):
    """A text that resembles a placeholder.

    :param offset: the position in the template, from 0.
    :param text: the beginning of the text.
    :param reason: why it is not a placeholder, and how to mend it.
    """

    offset: int
    text: str
    reason: str


@lru_cache(maxsize=1024)
def parse_template(template: str) -> tuple[Part, ...]:
    """Split a template into parts. Every text is a valid template."""
    return tuple(part for _, part in _scan(template))


def _scan(template: str) -> Iterator[tuple[int, Part]]:
    end = 0
    # as in Fawkes, all text between placeholders stays unchanged
    for match in _load_terminals()["PLACEHOLDER"].finditer(template):
        if match.start() > end:
            yield end, template[end : match.start()]
        yield match.start(), _parse_placeholder(match.group())
        end = match.end()
    if end < len(template):
        yield end, template[end:]


def _parse_placeholder(text: str) -> Placeholder:
    name = _load_terminals()["NAME"].match(text, len("?("))
    assert name is not None
    # Fawkes splits at every bar, even inside a pattern, so patterns cannot have alternatives
    pieces = text[name.end() : -len(")s")].split("|")
    return Placeholder(name.group(), tuple(_parse_step(piece) for piece in pieces if piece), text[-1])


def _parse_step(piece: str) -> Replacement | Misfit:
    if not (len(piece) > 2 and piece[0] == piece[-1] == "/"):  # noqa: PLR2004 - a slash at each end
        # the texts of both warnings are those of Fawkes, including the blank
        return Misfit(f"regex '{piece}' missing start/end slashes, ignoring")
    pattern, slash, replacement = piece[1:-1].partition("/")
    if not slash:
        return Misfit(f" regex '{piece}' missing mid slash, ignoring")
    return Replacement(pattern, replacement)


def find_suspected_placeholders(template: str) -> list[SuspectedPlaceholder]:
    """Return the texts that were probably meant as placeholders."""
    starts = [
        offset + match.start()
        for offset, part in _scan(template)
        if isinstance(part, str)
        for match in re.finditer(r"\?\(", part)
    ]
    return [
        SuspectedPlaceholder(start, _excerpt(template[start:]), _find_mistake(template[start:]))
        for start in starts
    ]


_EXCERPT_LENGTH = 40  # characters in an error


def _excerpt(text: str) -> str:
    """Return the beginning of a text, up to the type letter after a near ')'."""
    closing = text.find(")", 0, _EXCERPT_LENGTH)
    return text[: closing + 2] if closing >= 0 else text[:_EXCERPT_LENGTH]


def _find_mistake(text: str) -> str:
    """Return why a text that starts with ``?(`` is not a placeholder."""
    name = _load_terminals()["NAME"].match(text, len("?("))
    if name is None:
        return "the name of a parameter is missing after '?('"
    suffix = text[name.end() :]
    if suffix.startswith(")"):
        kind = suffix[1:2]
        return f"the type {f'{kind!r} ' if kind else ''}after ')' is not one of s, S, y, Y, i, f"
    if suffix.startswith("|"):
        if "//" in suffix.partition(")")[0]:
            return "a pattern and its replacement must not be empty: |/PATTERN/REPLACEMENT/"
        return "the part after '|' is not /PATTERN/REPLACEMENT/ followed by ')' and a type"
    if not suffix:
        return "the ')' is missing"
    return f"the character {suffix[0]!r} cannot be part of a parameter's name"
