"""Mistakes in a parameter file, one each: a key is dropped, misspelt, or has a value of the wrong type."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

_KEY = re.compile(r"(?P<indent> *)(?P<dash>- )?(?P<key>[\w-]+):(?P<value>.*)$")


class Mutation(NamedTuple):
    """A file with a mistake.

    :param kind: ``drop``, ``misspell`` or ``type``.
    :param path: of the key; the entries of lists are numbers.
    :param text: of the file.
    """

    kind: str
    path: str
    text: str


class _Line(NamedTuple):
    number: int
    end: int
    path: str
    match: re.Match[str]


def mutations(text: str, below: str = "") -> Iterator[Mutation]:
    """Yield the file with each mistake in the keys whose path begins with ``below``."""
    lines = text.splitlines()
    for line in _keys(lines):
        if line.path.startswith(below):
            yield Mutation("drop", line.path, _text(lines, line, _dropped(line)))
            yield Mutation("misspell", line.path, _text(lines, line, _misspelt(lines, line)))
            yield Mutation("type", line.path, _text(lines, line, [_wrong(line)]))


def _keys(lines: list[str]) -> Iterator[_Line]:
    """Yield the keys with their paths, and the line after their values."""
    parents: list[tuple[int, str]] = []
    counts: dict[str, int] = {}
    for number, line in enumerate(lines):
        match = _KEY.match(line)
        if match is None:
            continue
        column = len(match["indent"]) + len(match["dash"] or "")
        while parents and parents[-1][0] >= column:
            parents.pop()
        if match["dash"]:
            while parents and parents[-1][0] >= len(match["indent"]) and parents[-1][1].isdigit():
                parents.pop()
            above = "/".join(name for _, name in parents)
            counts[above] = counts.get(above, -1) + 1
            parents.append((column - 1, str(counts[above])))
        path = "/".join([*(name for _, name in parents), match["key"]])
        parents.append((column, match["key"]))
        yield _Line(number, _end(lines, number, column), path, match)


def _end(lines: list[str], number: int, column: int) -> int:
    """Return the line after a key's block."""
    for after in range(number + 1, len(lines)):
        text = lines[after]
        indent = len(text) - len(text.lstrip())
        if text.strip() and not text.strip().startswith("#"):
            deeper = indent > column or (indent == column and text.strip().startswith("- "))
            if not deeper:
                return after
    return len(lines)


def _dropped(line: _Line) -> list[str]:
    """The key is gone; the entry of a list that it began is still there."""
    return [f"{line.match['indent']}- zzz: 1"] if line.match["dash"] else []


def _misspelt(lines: list[str], line: _Line) -> list[str]:
    match = line.match
    key = match["key"] + "x"
    return [
        f"{match['indent']}{match['dash'] or ''}{key}:{match['value']}",
        *lines[line.number + 1 : line.end],
    ]


def _wrong(line: _Line) -> str:
    """A value in place of a map or list, a map in place of a value."""
    match = line.match
    has_value = match["value"].split(" #")[0].strip()
    value = "{zzz: 1}" if has_value else "zzz"
    return f"{match['indent']}{match['dash'] or ''}{match['key']}: {value}"


def _text(lines: list[str], line: _Line, instead: list[str]) -> str:
    return "\n".join([*lines[: line.number], *instead, *lines[line.end :]]) + "\n"
