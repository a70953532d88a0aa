"""The help of all commands has one style, and its examples are commands that parse."""

from __future__ import annotations

import re
import shlex

import pytest
import typer
from typer.core import TyperGroup

from cxbridge.cli import commands
from cxbridge.cli.discovery import in_sections, top_rows
from cxbridge.cli.main import app, invoke
from cxbridge.plugins import rows_of_modules
from tests.support import needs_all_plugins

pytestmark = needs_all_plugins

ROOT_COMMAND = typer.main.get_command(app)


def leaves(command, path=()):
    """All commands that are no groups, by their words."""
    for name in list(getattr(command, "commands", ())):
        below = command.commands[name]
        if hasattr(below, "commands"):
            yield from leaves(below, (*path, name))
        else:
            yield (*path, name), below


COMMANDS = dict(leaves(ROOT_COMMAND))
EXAMPLE = re.compile(r"Example:\n((?:  .+\n?)+)")


def test_all_commands_are_here():
    assert len(COMMANDS) > 60
    assert {
        ("run",),
        ("view",),
        ("bb", "hz"),
        ("trace", "diff"),
        ("daemon", "break", "add"),
    } <= COMMANDS.keys()


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_the_example_of_a_command_parses(path):
    found = EXAMPLE.search(COMMANDS[path].epilog or "")
    assert found is not None, "its docstring has to end with 'Example: cxbridge ...'"
    for line in found[1].splitlines():
        program, *words = shlex.split(line)
        assert (program, tuple(words[: len(path)])) == ("cxbridge", path)
        with COMMANDS[path].make_context(" ".join(path), words[len(path) :]) as context:
            assert context.args == []


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_parameters_are_told_in_sentences_and_have_names_for_their_values(path):
    command = COMMANDS[path]
    assert (command.help or "").split("\n\n")[0].endswith("."), command.help
    for parameter in command.params:
        text = getattr(parameter, "help", None) or ""
        values = (parameter.metavar or "").split("|")
        first = text.split(maxsplit=1)[0] if text else ""
        assert not text or text.endswith((".", ")", "]")), (path, text)
        assert not (first.isalpha() and first.islower()) or first in values, (path, text)
        if not getattr(parameter, "is_flag", False):
            assert parameter.metavar, (path, parameter.name)
            assert "<" not in parameter.metavar


def test_the_example_is_shown_on_a_line_of_its_own(capsys):
    assert invoke(["trace", "diff", "--help"]) == 0
    assert "\n  Example:\n    cxbridge trace diff " in capsys.readouterr().out


def test_every_command_is_in_a_section(capsys):
    sections = in_sections(top_rows(), commands.HELP_SECTIONS)
    named = [name for names in sections.values() for name in names]
    assert isinstance(ROOT_COMMAND, TyperGroup)
    assert sorted(named) == sorted(ROOT_COMMAND.commands)
    assert list(sections) == list(commands.HELP_SECTIONS)
    assert invoke(["--help"]) == 0
    text = capsys.readouterr().out
    places = [text.index(f"\n{title}:\n") for title, names in sections.items() if names]
    assert places == sorted(places)
    for name in named:
        assert re.search(rf"^  {name} ", text, re.MULTILINE), name


def test_the_sections_name_the_cores_commands_and_only_these():
    named = [name for names in commands.HELP_SECTIONS.values() for name in names]
    assert sorted(named) == sorted(row.name for row in rows_of_modules(commands))


def test_the_help_has_each_command_once():
    listed = [name for names in in_sections(top_rows(), commands.HELP_SECTIONS).values() for name in names]
    assert sorted(listed) == sorted(row.name for row in top_rows())
