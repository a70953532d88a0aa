"""The pages of the manual, cut into blocks."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from tests.support import ROOT

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
TUTORIALS = [page for page in PAGES if page.name.startswith("tutorial")]

CONSOLE = "console"
"""The language of a block whose lines behind ``$`` are run by the tests."""

USAGE = "usage"
"""The language of a block with the syntax of a command, with NAMES as placeholders."""

INDENTED = "indented"

_PROGRAMS = (
    r"(?:\.venv/bin/)?(?:cxbridge|pytest|pip|python3?)|make|docker|systemctl|mongod|mongosh|openssl|useradd|"
    r"git|cp|mkdir|cd|curl|ssh|apt|printf|chmod|ffbblog|ffplugin|skillet"
)
_COMMAND = re.compile(rf"(?:- run: )?(?P<prompt>\w*\$ +)?(?P<text>(?:{_PROGRAMS}|\.)(?: .*)?)$")
_FENCE = re.compile(r"( *)```([\w-]*)$")


def name_of(page: Path) -> str:
    """Return the path of a page below docs, or the name of a page elsewhere."""
    docs = ROOT / "docs"
    return page.relative_to(docs).as_posix() if page.is_relative_to(docs) else page.name


@dataclass(frozen=True)
class Block:
    """Text that is no prose: language, number of the first line in the page, lines."""

    language: str
    line: int
    lines: tuple[str, ...]

    @property
    def commands(self) -> list[str]:
        """The texts behind ``$``."""
        return [text.lstrip()[2:] for text in self.lines if text.lstrip().startswith("$ ")]


def blocks(text: str) -> list[Block]:
    """Cut out fenced text, and text with an indentation of four or more."""
    found: list[Block] = []
    lines = text.splitlines()
    number = 0
    while number < len(lines):
        if fence := _FENCE.match(lines[number]):
            end = lines.index(f"{fence[1]}```", number + 1)
            inner = tuple(line.removeprefix(fence[1]) for line in lines[number + 1 : end])
            found.append(Block(fence[2], number + 2, inner))
            number = end + 1
        else:
            if lines[number].startswith("    "):
                found.append(Block(INDENTED, number + 1, (lines[number].strip(),)))
            number += 1
    return found


def looks_like_commands(block: Block) -> list[str]:
    """Return the lines that a user would type; a backslash joins lines."""
    joined = "\n".join(block.lines).replace("\\\n", " ")
    found = (_COMMAND.match(line.strip()) for line in joined.splitlines())
    return [" ".join(match["text"].split("  #")[0].split()) for match in found if match]


def commands(page: Path) -> list[str]:
    """All commands of a page that the tests run."""
    return [
        line for block in blocks(page.read_text()) if block.language == CONSOLE for line in block.commands
    ]
