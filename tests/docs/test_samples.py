"""The commands shown in README.md and docs/ work as shown; links lead somewhere."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys

import pytest

from cxbridge.cli.main import invoke
from tests.support import ROOT

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
CONSOLE = re.compile(r"^```console\n(.*?)^```", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


PART = re.compile(
    r"^(?:(?P<how>File|Add to) `(?P<file>[^`]+)`:\n\n```\w+\n(?P<text>.*?)^```"
    r"|```console\n(?P<console>.*?)^```)",
    re.DOTALL | re.MULTILINE,
)
"""In a tutorial: a file to write or to add to, or commands."""

TUTORIALS = [page for page in PAGES if page.name.startswith("tutorial")]


AFTER = re.compile(r"goes on in the folder of \[.*?\]\((tutorial-[\w-]+\.md)\)")
"""How a tutorial says that it begins where another ended."""


def write(part, folder):
    """Write a file of a tutorial, or add to it."""
    file = folder / part["file"]
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("w" if part["how"] == "File" else "a") as output:
        output.write(part["text"])


def commands(page):
    """The lines behind ``$`` of a page's console blocks."""
    blocks = CONSOLE.findall(page.read_text())
    return [line[2:] for block in blocks for line in block.splitlines() if line.startswith("$ ")]


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.name)
def test_a_tutorial_works_as_written(page, tmp_path, monkeypatch, capsys):
    """Its files are written, its commands run, with the statuses shown.

    In a folder that is empty, or has the files of the tutorial before.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")  # others' take long to import
    done = 0
    page_text = page.read_text()
    if before := AFTER.search(page_text):
        for part in PART.finditer((page.parent / before[1]).read_text()):
            if part["file"]:
                write(part, tmp_path)
    for part in PART.finditer(page_text):
        if part["file"]:
            write(part, tmp_path)
            continue
        for line in part["console"].splitlines():
            text, _, expected = line.removeprefix("$ ").partition("  # exit status ")
            program, *arguments = shlex.split(text)
            if program == "cxbridge":
                assert invoke(arguments) == int(expected or 0), (line, capsys.readouterr())
            else:
                assert program == "pytest"
                command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "cxbridge"]
                run = subprocess.run(
                    [*command, *arguments], check=False, capture_output=True, text=True, timeout=120
                )
                assert run.returncode == int(expected or 0), (line, run.stdout, run.stderr)
            done += 1
    assert done


@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if page not in TUTORIALS and commands(page)],
    ids=lambda page: page.name,
)
def test_the_commands_of_a_page_work_in_order(page, tmp_path, monkeypatch, capsys):
    for part in ("scenarios", "interfaces", "luaskills", "tests"):
        (tmp_path / part).symlink_to(ROOT / part)
    monkeypatch.chdir(tmp_path)
    for command in commands(page):
        program, *arguments = shlex.split(command, comments=True)
        assert program == "cxbridge"
        assert invoke(arguments) == 0, (command, capsys.readouterr().err)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in LINK.findall(page.read_text()):
        if "://" not in target:
            assert (page.parent / target).exists(), target


def test_readme_begins_with_the_two_commands():
    text = (ROOT / "README.md").read_text()
    assert re.findall(r"^    (make \w+)", text, re.MULTILINE) == ["make run", "make test"]
    makefile = (ROOT / "Makefile").read_text()
    assert re.search(r"^run:", makefile, re.MULTILINE)
    assert re.search(r"^test:", makefile, re.MULTILINE)
