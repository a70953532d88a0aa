"""Checks the English of the manual, of docstrings, and of help texts and messages.

``python -m tests.docs.prose`` prints ``FILE:LINE: words: better words`` for each finding, and exits with 1 if
there is one. Two sources: proselint, and this project's own word list in ``prose.toml``.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from proselint.checks import __register__ as proselint_checks
from proselint.config import DEFAULT, Config
from proselint.registry import CheckRegistry
from proselint.tools import LintFile

from tests.support import ROOT, module_files

WORDS = Path(__file__).with_name("prose.toml")

_BEGINS = re.compile(r"[|#*>:-]|\d+\. ")
"""Beginnings of lines that do not continue the sentence of the line above."""

_FENCE = re.compile(r"^( *)```.*?^\1```$", re.DOTALL | re.MULTILINE)
_GENERATED = re.compile(r"(?<=<!-- )(\w+): python .*?(?=<!-- /\1 -->)", re.DOTALL)
"""A generated part, whose words are checked in the code."""
_INDENTED = re.compile(r"(?<=\n\n)(?:    .*\n)+")
_CODE = re.compile(r"(`+)[^`]+?\1")
_LINK = re.compile(r"\]\([^)]*\)|<https?:[^>]*>|https?://\S+")
_FIELD = re.compile(r":(?:param|returns?|raises?|ivar|cvar)\b[^:\n]*:")


class Finding(NamedTuple):
    """Words with a better alternative."""

    path: str
    line: int
    words: str
    better: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.words!r}: {self.better}"


@dataclass(frozen=True)
class Habit:
    """One entry of the word list."""

    say: re.Pattern[str]
    better: str

    @classmethod
    def of(cls, entry: dict[str, str]) -> Habit:
        """Read an entry."""
        return cls(re.compile(entry["say"], re.IGNORECASE | re.MULTILINE), entry["better"])


def _masked(match: re.Match[str], by: str) -> str:
    """Return blank text of the same length and the same lines."""
    return re.sub(r"[^\n]", by, match[0])


def _without_code(text: str) -> str:
    text = _CODE.sub(lambda match: _masked(match, "_"), text)
    text = _FIELD.sub(lambda match: _masked(match, " "), text)
    return _LINK.sub(lambda match: _masked(match, "_"), text)


def prose_of_markdown(text: str) -> str:
    """Return the prose of a page: code is blanked, lines keep their numbers."""
    for pattern in (_GENERATED, _FENCE, _INDENTED):
        text = pattern.sub(lambda match: _masked(match, " "), text)
    return _without_code(text)


def _literals(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the literals of a node of the syntax tree that people read."""
    match node:
        case ast.Expr(value=ast.Constant(value=str()) as docstring):
            yield docstring
        case ast.keyword(arg="help" | "epilog" | "short_help" | "hint", value=value):
            yield value
        case ast.Call(func=ast.Attribute(attr="debug" | "info" | "warn" | "error"), args=arguments):
            yield from (one for one in arguments if isinstance(one, ast.Constant | ast.JoinedStr))
        case ast.Call(func=ast.Name(id="Finding" | "Diagnostic" | "LiveFinding"), args=arguments):
            yield from (one for one in arguments if isinstance(one, ast.Constant | ast.JoinedStr))
        case ast.Raise(exc=ast.Call(args=arguments)):
            yield from (one for one in arguments if isinstance(one, ast.Constant | ast.JoinedStr | ast.BinOp))


def prose_of_python(text: str) -> str:
    """Return a module's docstrings, help texts and error messages, at their lines; code is blank."""
    lines = text.splitlines()
    kept = [""] * len(lines)
    for node in ast.walk(ast.parse(text)):
        for literal in _literals(node):
            assert isinstance(literal, ast.expr)
            first, last = literal.lineno - 1, literal.end_lineno or literal.lineno
            for number in range(first, last):
                begin = literal.col_offset if number == first else 0
                kept[number] = " " * begin + lines[number][begin:].replace('"""', "   ")
            kept[last - 1] = kept[last - 1][: literal.end_col_offset]
    return _without_code("\n".join(kept) + "\n")


def unreleased(changelog: str) -> str:
    """Return the unreleased part of a changelog, which can still change."""
    head, mark, rest = changelog.partition("\n## ")
    return head + mark + rest.partition("\n## ")[0]


def pages() -> Iterator[tuple[Path, str]]:
    """Yield each file with its prose."""
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        yield path, prose_of_markdown(path.read_text())
    yield ROOT / "CHANGELOG.md", prose_of_markdown(unreleased((ROOT / "CHANGELOG.md").read_text()))
    for path in module_files().values():
        yield path, prose_of_python(path.read_text())


class Text:
    """The prose of many files as one text, so that each pattern runs once: a second instead of twenty.

    :param files: name and prose of each file, with blanks for code.
    """

    def __init__(self, files: Iterable[tuple[str, str]]) -> None:
        self._begins: list[int] = []
        self._places: list[tuple[str, int]] = []
        parts: list[str] = []
        length = 0
        for path, prose in files:
            before = -1
            for number, line in enumerate(prose.splitlines(), start=1):
                if words := " ".join(line.split()):
                    goes_on = number == before + 1 and not _BEGINS.match(words)
                    parts += [" " if goes_on else "\n\n", words]
                    length += len(parts[-2])
                    self._begins.append(length)
                    self._places.append((path, number))
                    length += len(words)
                    before = number
        self.text = "".join(parts) + "\n"

    def place(self, position: int) -> tuple[str, int]:
        """Return the file and the line of a position in the text."""
        return self._places[max(0, bisect_right(self._begins, position) - 1)]


class Linter:
    """The word list and proselint.

    :param words: a file like ``prose.toml``.
    """

    def __init__(self, words: Path = WORDS) -> None:
        entries = tomllib.loads(words.read_text())
        self._habits = [Habit.of(entry) for entry in entries["habit"]]
        self._allowed = re.compile("|".join(map(re.escape, entries["allow"]["texts"])))
        checks = DEFAULT["checks"] | dict.fromkeys(entries["proselint"]["off"], False)
        self._config: Config = {"max_errors": 10_000, "checks": dict(sorted(checks.items(), reverse=True))}
        if not CheckRegistry().checks:
            CheckRegistry().register_many(proselint_checks)

    def findings(self, files: Iterable[tuple[str, str]]) -> list[Finding]:
        """Check files: each one's name and prose."""
        text = Text(files)
        found = [
            (match.start() + len(match[0]) - len(match[0].lstrip()), match[0], habit.better)
            for habit in self._habits
            for match in habit.say.finditer(text.text)
        ]
        for result in LintFile("prose", text.text).lint(self._config):
            begin, end = (at - 1 for at in result.check_result.span)  # proselint inserts a line in front
            found.append((begin, text.text[begin:end], result.check_result.message))
        allowed = [match.span() for match in self._allowed.finditer(text.text)]
        return [
            Finding(*text.place(at), words.strip(), better)
            for at, words, better in sorted(found)
            if not any(begin <= at < end for begin, end in allowed)
        ]


def main(parts: list[str]) -> int:
    """Check all files, or those whose path contains one of the words given."""
    files = [(str(path.relative_to(ROOT)), prose) for path, prose in pages()]
    found = Linter().findings(
        (path, prose) for path, prose in files if not parts or any(p in path for p in parts)
    )
    for finding in found:
        print(finding)  # noqa: T201
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
