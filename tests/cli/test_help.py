"""The help has each command once; examples are commands that parse, descriptions are sentences."""

from __future__ import annotations

import re
import shlex

import typer

from cxbridge.cli import commands
from cxbridge.cli.discovery import names_by_section, top_level_rows
from cxbridge.cli.main import app
from cxbridge.plugins import make_module_rows
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


def test_examples_of_commands_parse_and_parameters_have_sentences():
    wrong = {}
    for path, command in COMMANDS.items():
        found = EXAMPLE.search(command.epilog or "")
        for line in found[1].splitlines() if found else ["no 'Example: cxbridge ...' ends the docstring"]:
            program, *words = shlex.split(line)
            if (program, tuple(words[: len(path)])) != ("cxbridge", path):
                wrong[path] = line
                continue
            with command.make_context(" ".join(path), words[len(path) :]) as context:
                if context.args:
                    wrong[path] = line
    assert COMMANDS
    descriptions = (
        parameter.help or "None." for command in COMMANDS.values() for parameter in command.params
    )
    assert (wrong, [text for text in descriptions if not re.fullmatch("[^a-z].*[.]", text)]) == ({}, [])


def test_sections_name_exactly_commands_of_core():
    assert sorted(name for names in commands.HELP_SECTIONS.values() for name in names) == sorted(
        row.name for row in make_module_rows(commands)
    )


def test_help_has_each_command_once():
    sections = names_by_section(top_level_rows(), commands.HELP_SECTIONS)
    listed = [name for names in sections.values() for name in names]
    assert sorted(listed) == sorted(row.name for row in top_level_rows())
