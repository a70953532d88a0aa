"""The commands shown in README.md and docs/ work as shown; links have targets."""

from __future__ import annotations

import re
import tempfile
import textwrap
from pathlib import Path

import pytest

from tests.docs.pages import PAGES, TUTORIALS, commands, name_of
from tests.docs.shell import Shell
from tests.support import FAWKES_DIR, ROBOTINO_DIR, ROOT, SHARED, share

LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")

PART = re.compile(
    r"^(?:(?P<how>File|Add to) `(?P<file>[^`]+)`:\n\n```\w+\n(?P<text>.*?)^```"
    r"| *```console\n(?P<console>.*?)^ *```)",
    re.DOTALL | re.MULTILINE,
)
"""A file to write or to append to, or commands with their output."""

AFTER = re.compile(r"continues in the folder of \[.*?\]\((tutorial-[\w-]+\.md)\)")
"""The sentence of a page that continues a tutorial."""

ELSEWHERE = {
    "~/fawkes-robotino": ROBOTINO_DIR,
    "~/fawkes": FAWKES_DIR,
    "~/recording": SHARED / "traces" / "test-scenario" / "skiller-1" if SHARED.is_dir() else None,
}
"""The manual's names for a checkout of Fawkes and a recording of Fawkes, which may be absent."""


@pytest.fixture
def ipc():
    """A folder whose path leaves room for a socket's name."""
    with tempfile.TemporaryDirectory(prefix="cx") as folder:
        yield Path(folder)


def write(part, folder):
    """Write a file of a tutorial, or append to the file."""
    file = folder / part["file"]
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("w" if part["how"] == "File" else "a") as output:
        output.write(part["text"])


def expected_part(line):
    """The part of a line of output that has to appear: all before ``...``."""
    return line.partition("...")[0].rstrip()


def play(page, folder, shell, capfd):
    """Write the files of a page and run its commands, in their order; return the number of commands."""
    text = page.read_text()
    if before := AFTER.search(text):
        for part in PART.finditer((page.parent / before[1]).read_text()):
            if part["file"]:
                write(part, folder)
    done = 0
    left_out = False
    for part in PART.finditer(text):
        if part["file"]:
            write(part, folder)
        elif any(name in part["console"] and (left_out or not meant) for name, meant in ELSEWHERE.items()):
            left_out = True  # and later commands, which may need its files
        else:
            printed = ""
            for line in textwrap.dedent(part["console"]).splitlines():
                if line.startswith("$ "):
                    capfd.readouterr()
                    shell.run(line.removeprefix("$ "))
                    captured = capfd.readouterr()
                    printed = captured.out + captured.err
                    done += 1
                else:
                    assert expected_part(line) in printed, (line, printed)
    return done


SHOWN = share([page for page in PAGES if commands(page)], 9, row=lambda page: page in TUTORIALS)


@pytest.mark.parametrize("page", SHOWN, ids=name_of)
def test_page_works_as_written(page, tmp_path, ipc, monkeypatch, capfd):
    """The files are written and the commands run, with the statuses and the output shown.

    A tutorial starts in an empty folder, or with the files of the tutorial before; a page in a checkout.
    """
    if page not in TUTORIALS:
        for part in ("scenarios", "interfaces", "luaskills", "tests"):
            (tmp_path / part).symlink_to(ROOT / part)
    monkeypatch.chdir(tmp_path)
    names = {name: str(meant) for name, meant in ELSEWHERE.items() if meant}
    with Shell(tmp_path, ipc, monkeypatch.setenv, names) as shell:
        if not play(page, tmp_path, shell, capfd):
            pytest.skip(f"needs {' and '.join(ELSEWHERE)}")


def test_links_have_targets():
    links = [(page, target) for page in PAGES for target in LINK.findall(page.read_text())]
    assert links
    assert [link for link in links if "://" not in link[1] and not (link[0].parent / link[1]).exists()] == []


def test_readme_begins_with_run_and_test():
    text = (ROOT / "README.md").read_text()
    assert re.findall(r"^    (make \w+)", text, re.MULTILINE) == ["make run", "make test"]
    makefile = (ROOT / "Makefile").read_text()
    assert re.search(r"^run:", makefile, re.MULTILINE)
    assert re.search(r"^test:", makefile, re.MULTILINE)
