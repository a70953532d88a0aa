"""Each mistake of a new user is reported at once: one cause, its place, and nothing that only follows."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import pytest

from tests.forked import Nursery, nursery
from tests.mistakes.making import run_seconds, tell
from tests.mistakes.table import MISTAKES, WITHOUT_LINE
from tests.mistakes.table.mistake import BAD_INPUT, DAEMON, RUN, STUCK, Mistake
from tests.support import needs_plugin, share

MOST_SECONDS: Final = 2.0
"""Of the run's clock, until nothing can happen any more."""

TOLD_BY_CHECKS: Final = {
    "a parenthesis is missing",
    "a parenthesis is missing at the end of the file",
    "a string never closes",
    "the arrow is missing",
    "a rule has no name",
    "a deftemplate is misspelt in a condition",
    "a deftemplate is misspelt in assert",
    "a variable is misspelt",
    "a defglobal is not defined",
    "a goal mode is misspelt in a condition",
    "a type of a slot is misspelt",
    "the file is named wrongly",
}
"""The mistakes of CLIPS and PDDL in whose lines the studio's checks say more than the core."""

PLACED_BY_STUDIO: Final = {
    "the plan names an action that the domain lacks",
    "there are more names than values",
}
"""The mistakes whose line in a CLIPS file only the studio knows."""

NEEDED_PLUGINS: Final = {
    "the feature is not requested": "planning",
    "the URL of the Skiller is misspelt": "fawkes",
}
"""The mistakes in the use of a plug-in: without the plug-in, its package is the error."""

ROWS: Final = [
    pytest.param(
        each,
        id=f"{kind}: {each.name}",
        marks=[needs_plugin("studio")]
        if (kind in ("CLIPS", "PDDL", "daemon") and each.name in TOLD_BY_CHECKS)
        or each.name in PLACED_BY_STUDIO
        or each.status == STUCK
        else [needs_plugin(plugin) for name, plugin in NEEDED_PLUGINS.items() if name == each.name],
    )
    for kind, mistakes in MISTAKES.items()
    for each in mistakes
]
MOST_WITHOUT_LINE: Final = 15
"""It only becomes less."""

_PLACE: Final = re.compile(r"\w\.\w+:\d+$")
_ABOUT_ERRORS: Final = re.compile(r"E CLIPS \(\w+\): ")
"""What CLIPS prints of an error in a rule, in two lines."""


@pytest.fixture(name="forks", scope="module")
def _nursery() -> Nursery:
    return nursery()


def told(mistake: Mistake, folder: Path, forks: Nursery) -> tuple[int, list[str]]:
    done = tell(mistake, folder, forks)
    text = (done.stdout + done.stderr).decode().replace(f"{folder}/", "")
    return done.returncode, text.splitlines()


def test_the_agent_is_fine_without_them(tmp_path: Path, forks: Nursery) -> None:
    status, lines = told(Mistake("none", "", command=RUN), tmp_path, forks)
    assert status == 0, lines
    assert len(lines) == 3


def test_each_has_a_name() -> None:
    assert len({row.id for row in ROWS}) == len(ROWS)


def test_each_names_the_line_where_it_is_told() -> None:
    places = {f"{kind}: {each.name}": each.at for kind, mistakes in MISTAKES.items() for each in mistakes}
    without = {name for name, at in places.items() if not _PLACE.search(at)}
    assert without == WITHOUT_LINE.keys()
    assert len(without) <= MOST_WITHOUT_LINE


@pytest.mark.parametrize("mistake", share(ROWS, 24, row=lambda row: str(row.id).partition(":")[0]))
def test_it_is_told_at_once_with_its_place(mistake: Mistake, tmp_path: Path, forks: Nursery) -> None:
    status, lines = told(mistake, tmp_path, forks)
    text = "\n".join(lines)
    assert status == mistake.status, text
    assert "Traceback" not in text
    assert "stack traceback" not in text
    at = re.compile(re.escape(mistake.at) + (r"\b" if mistake.at else ""))
    causes = [line for line in lines if re.search(mistake.says, line) and at.search(line)]
    assert causes, text
    assert run_seconds(text) <= MOST_SECONDS
    others = [line for line in lines if line[:2] in ("E ", "W ") and line not in causes]
    if mistake.command[: len(DAEMON)] == DAEMON:
        others = [line for line in others if not line.startswith(("E Daemon", "E CLIPS"))]
    assert [line for line in others if not _ABOUT_ERRORS.match(line)] == []
    if mistake.status == BAD_INPUT:
        assert "mistakes" not in lines[-1], text
        summaries = [line for line in lines if line.startswith(("cxbridge: error: ", "Error: "))]
        assert len(summaries) == 1
