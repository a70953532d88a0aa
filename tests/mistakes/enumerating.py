"""Mistakes that nobody thought of: each file of an agent is spoilt in each way, each key of its configuration
is misspelt and gets a value of each wrong type."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

_KEY: Final = re.compile(r"^(\s*(?:- )?)([\w/-]+):(.*)$")


def _truncated(file: Path) -> None:
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def _folder(file: Path) -> None:
    file.unlink()
    file.mkdir()


def _unreadable(file: Path) -> None:
    file.chmod(0)


def _linked(target: str) -> Callable[[Path], None]:
    def spoil(file: Path) -> None:
        file.unlink()
        file.symlink_to(target.format(file.name))

    return spoil


def _again(encoding: str) -> Callable[[Path], None]:
    def spoil(file: Path) -> None:
        file.write_bytes(file.read_text().encode(encoding))

    return spoil


def _with_nul(file: Path) -> None:
    data = file.read_bytes()
    middle = data.index(b"\n", len(data) // 2)
    file.write_bytes(data[:middle] + b" \0" + data[middle:])


SPOILT: Final[dict[str, Callable[[Path], object]]] = {
    "is gone": Path.unlink,
    "is empty": lambda file: file.write_text(""),
    "ends in the middle": _truncated,
    "is a folder": _folder,
    "cannot be read": _unreadable,
    "is binary": lambda file: file.write_bytes(bytes(range(256)) * 4),
    "is a link to nothing": _linked("nothing-{}"),
    "is a link to itself": _linked("{}"),
    "is in UTF-16": _again("utf-16"),
    "has a NUL in it": _with_nul,
}
"""What can be wrong with a file."""

HARMLESS: Final[dict[str, Callable[[Path], object]]] = {
    "begins with a byte order mark": _again("utf-8-sig"),
    "has the line ends of Windows": lambda file: file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n")),
    "has a very long line": lambda file: file.write_text(file.read_text() + _comment(file, "x" * 200_000)),
}
"""What looks odd in a file, and is fine."""


def _comment(file: Path, text: str) -> str:
    begin, end = {".clp": (";", ""), ".pddl": (";", ""), ".lua": ("--", ""), ".xml": ("<!--", "-->")}.get(
        file.suffix, ("#", "")
    )
    return f"{begin} {text}{end}\n"


WRONG: Final = {
    "null": "null",
    "a list": "[1, {a: b}]",
    "a map": "{a: b}",
    "a number": "17",
    "a truth value": "true",
    "an empty text": "''",
}
"""Values, of which each key takes one sort at most."""


def files(agent: Path) -> list[str]:
    """Return the files of an agent, that a run reads."""
    return sorted(
        str(path.relative_to(agent)) for path in agent.rglob("*") if path.is_file() and path.suffix != ".md"
    )


def keys(text: str) -> Iterator[tuple[str, int, str]]:
    """Yield the changes of a configuration, each with its line, from 1, and the text that has it."""
    lines = text.splitlines()
    for number, line in enumerate(lines):
        match = _KEY.match(line)
        if match is None:
            continue
        begin, key, value = match.groups()
        depth = len(begin)
        end = number + 1
        while end < len(lines) and (not lines[end].strip() or _depth(lines[end]) > depth):
            end += 1
        before, after = lines[:number], lines[end:]
        misspelt = f"{key[:-2]}{key[-1]}{key[-2]}"
        yield (
            f"{key} is misspelt",
            number + 1,
            "\n".join([*before, f"{begin}{misspelt}:{value}", *lines[number + 1 :], ""]),
        )
        for what, wrong in WRONG.items():
            yield (
                f"{key} is {what}",
                number + 1,
                "\n".join([*before, f"{begin}{key}: {wrong}", *after, ""]),
            )


def _depth(line: str) -> int:
    match = re.match(r"\s*(?:- )?", line)
    return 0 if match is None else match.end()
