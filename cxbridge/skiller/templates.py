"""Templates of skill strings: text with placeholders such as ``?(name)s``. The grammar is ``templates.lark``.

:func:`find_suspected_placeholders` finds texts that resemble placeholders.
"""

from __future__ import annotations

import re
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


class IgnoredStep(Struct, frozen=True):
    """A step that Fawkes ignores with a warning."""

    warning: str


class Placeholder(Struct, frozen=True):
    """A placeholder for a parameter's value.

    :param name: the name of the parameter.
    :param kind: ``s`` and ``S`` put the value in quotes, ``y`` and ``Y`` do not, ``S`` and ``Y``
        convert it to upper case; ``i`` is an integer, ``f`` a float.
    """

    name: str
    steps: tuple[Replacement | IgnoredStep, ...]
    kind: str


PLACEHOLDER_FORM: Final = "?(NAME)T or ?(NAME|/PATTERN/REPLACEMENT/)T; T is one of s, S, y, Y, i, f"
"""The notation of placeholders, for messages."""

# an excerpt for messages: up to the letter T after a ')', but at most about 40 characters
_SUSPECTED_PLACEHOLDER: Final = re.compile(r"\?\([^)]{0,37}(?:\).?)?", re.DOTALL)

Part = str | Placeholder
"""A part of a template: literal text or a placeholder."""


@lru_cache(maxsize=1024)  # chosen freely: far more templates than usual domains have actions
def parse_template(template: str) -> tuple[Part, ...]:
    """Split a template into parts. Every text is a valid template."""
    parts: list[Part] = []
    end = 0
    # as in Fawkes, all text between placeholders stays unchanged
    for match in _load_terminals()["PLACEHOLDER"].finditer(template):
        if match.start() > end:
            parts.append(template[end : match.start()])
        parts.append(_parse_placeholder(match.group()))
        end = match.end()
    if end < len(template):
        parts.append(template[end:])
    return tuple(parts)


def _parse_placeholder(text: str) -> Placeholder:
    name = _load_terminals()["NAME"].match(text, len("?("))
    assert name is not None  # PLACEHOLDER contains NAME
    # Fawkes splits at every bar, even inside a pattern, so patterns cannot have alternatives
    pieces = text[name.end() : -len(")s")].split("|")
    return Placeholder(name.group(), tuple(_parse_step(piece) for piece in pieces if piece), text[-1])


def _parse_step(piece: str) -> Replacement | IgnoredStep:
    if not (len(piece) > 2 and piece[0] == piece[-1] == "/"):  # noqa: PLR2004 - a slash at each end
        # the texts of both warnings are those of Fawkes, including the blank
        return IgnoredStep(f"regex '{piece}' missing start/end slashes, ignoring")
    pattern, slash, replacement = piece[1:-1].partition("/")
    if not slash:
        return IgnoredStep(f" regex '{piece}' missing mid slash, ignoring")
    return Replacement(pattern, replacement)


def find_suspected_placeholders(template: str) -> list[str]:
    """Return the texts that were probably meant as placeholders."""
    return [
        match.group()
        for part in parse_template(template)
        if isinstance(part, str)
        for match in _SUSPECTED_PLACEHOLDER.finditer(part)
    ]
