"""docs/thesis.md has no line without a command or a reason."""

from __future__ import annotations

import re

import pytest

from tests.docs.test_commands import unknown_words
from tests.support import ROOT

TEXT = (ROOT / "docs" / "thesis.md").read_text()
LAST = re.compile(r"`(cxbridge [^`]+)`|Reason: \S.{15,}")


def rows():
    """The cells of each row, without the heads of the tables."""
    lines = [line for line in TEXT.splitlines() if line.startswith("|")]
    for line, below in zip(lines, [*lines[1:], ""], strict=True):
        if not line.startswith("| ---") and not below.startswith("| ---"):
            yield [cell.strip() for cell in line.strip("|").split(" | ")]


ROWS = list(rows())
COMMANDS = [match[1] for *_, last in ROWS if (match := LAST.fullmatch(last)) and match[1]]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0][:40])
def test_every_line_has_a_command_or_a_reason(row):
    what, where, last = row
    assert what
    assert where
    assert LAST.fullmatch(last), f"neither a command nor a reason: {last}"


@pytest.mark.parametrize("command", sorted(set(COMMANDS)))
def test_the_commands_are_commands(command):
    assert unknown_words(command) == []


def test_what_is_neither_is_noticed():
    assert not LAST.fullmatch("see the manual")
    assert not LAST.fullmatch("Reason: none")
    assert unknown_words("cxbridge trace nothing RUN")


@pytest.mark.parametrize("chapter", ["1", "2", "3", "4", "5", "6"])
def test_each_chapter_is_there(chapter):
    assert re.search(rf"^## Chapters? [^:]*\b{chapter}\b", TEXT, re.MULTILINE)


def test_all_figures_but_that_of_the_authors_and_of_the_design_are_named():
    assert set(re.findall(r"\bfigures? (\d+)|and (\d+)\)", TEXT, re.IGNORECASE)) >= {
        (number, "") for number in ("2", "4", "5", "6", "7", "9", "10")
    }
