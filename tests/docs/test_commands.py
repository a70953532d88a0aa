"""Each command of the manual is run, or has a reason; each command and option is documented."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest
import typer

from cxbridge.cli.main import app
from cxbridge.errors import CxbridgeError
from tests.docs.not_run import CI_ITSELF, NOT_RUN
from tests.docs.pages import CONSOLE, PAGES, USAGE, blocks, commands, looks_like_commands, name_of
from tests.forked import nursery
from tests.support import ROOT

PAGE = (ROOT / "docs" / "commands.md").read_text()
TREE: Any = typer.main.get_command(app)


def options(command):
    """All spellings of a command's options; for a group, also those of its commands."""
    own = {name for item in command.params for name in (*item.opts, *item.secondary_opts) if name[0] == "-"}
    return own.union(*(options(child) for child in getattr(command, "commands", {}).values()))


def unknown_words(line):
    """Unknown commands and options of a line.

    A word behind ``|`` with blanks around it is a sibling of the command before.
    """
    text = re.sub(r"'[^']*'|\"[^\"]*\"", "X", line.partition("  ")[0]).removeprefix("cxbridge ")
    unknown = []
    group = TREE
    for part in re.split(r" \| (?=[a-z])", text):
        words = part.split()
        command: Any = group
        while words and words[0] in getattr(command, "commands", {}):
            group, command = command, command.commands[words.pop(0)]
        begun = words[0] if words else ""
        if (command is TREE and begun[:1] != "-") or (
            hasattr(command, "commands") and "start" not in command.commands and re.match(r"[a-z]", begun)
        ):
            unknown.append(begun)
        given = re.findall(r"(?<![\w-])--?[a-z][a-z0-9-]*", " ".join(words))
        unknown += [one for one in given if one not in options(command) | {"-h", "--help"}]
    return unknown


def shown_lines(language):
    for page in PAGES:
        for block in blocks(page.read_text()):
            if block.language == language:
                for line in block.lines:
                    yield page, line


def test_every_command_is_run_or_has_reason():
    run = {line.split("  #")[0] for page in PAGES for line in commands(page)}
    missing: dict[str, dict[str, int]] = {}
    for page in PAGES:
        for block in blocks(page.read_text()):
            if block.language in {CONSOLE, USAGE}:
                continue
            for line in looks_like_commands(block):
                if line not in run and line not in NOT_RUN.get(name_of(page), {}):
                    missing.setdefault(name_of(page), {})[line] = block.line
    assert missing == {}, "make it a console block, or add it to tests/docs/not_run.py with a reason"


def test_excluded_commands_are_in_pages():
    for name, lines in NOT_RUN.items():
        (page,) = (page for page in PAGES if name_of(page) == name)
        found = [line for block in blocks(page.read_text()) for line in looks_like_commands(block)]
        assert [line for line in lines if line not in found] == [], name


def test_commands_of_ci_are_in_script():
    script = (ROOT / ".ci" / "run").read_text()
    for lines in NOT_RUN.values():
        for line, reason in lines.items():
            if reason == CI_ITSELF:
                assert f"{line}\n" in script


def test_commands_and_options_exist():
    lines = {line for _, line in shown_lines(USAGE) if line.startswith("cxbridge")}
    assert lines
    lines |= {line for lines in NOT_RUN.values() for line in lines if line.startswith("cxbridge ")}
    assert {line: unknown_words(line) for line in lines if unknown_words(line)} == {}


@pytest.mark.parametrize(
    "line",
    ["cxbridge trace nothing FILE", "cxbridge run X --nothing", "cxbridge env list | none", "cxbridge none"],
)
def test_unknown_commands_and_options_are_found(line):
    assert unknown_words(line)


def test_commands_md_has_status_of_every_error():
    statuses = [tuple(row) for row in json.loads(nursery().run([], program="tests.docs.statuses").stdout)]
    assert ("CxbridgeError", 2) in statuses
    assert len(statuses) > 20
    special = [row for row in statuses if row[1] != CxbridgeError.exit_status]
    assert special
    assert [(name, status) for name, status in special if f"`{name}`, {status}:" not in PAGE] == []
