"""A common style for the help of all commands; options with an optional value."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Final

from typer.core import TyperCommand

EXAMPLE: Final = "\n\nExample: "
"""The start of the last paragraph of a command's docstring."""

# Makes click preserve the line breaks of a paragraph.
_KEEP_LINES: Final = "\b"

# Metavars by the names of parameters, so that all commands use the same word for the same kind of value.
_DIRECTORY: Final = re.compile(r"(?:dir|bblog|clients|checkout|ros2cx)s?$")
_SECONDS: Final = re.compile(r"(?:timeout|duration|hold|seconds)$")
_METAVARS: Final = {
    "agent": "NAME",
    "spec": "NAME",
    "space": "NAME",
    "planner": "NAME",
    "scenario": "NAME",
    "clock": "virtual|real|scaled:N|ros2",
    "core": "builtin|fawkes",
    "trace_level": "transitions|rules|facts",
    "level": "transitions|skills|rules|facts|blackboard",
    "order": "total|partial",
    "replay_order": "total|partial",
    "on_failure": "stop|continue",
    "fawkes_host": "HOST",
    "fawkes_port": "PORT",
}


class StyledCommand(TyperCommand):
    """A command in which options with a metavar like ``[PORT]`` have an optional value.

    The next word is the value only if it is a number. Click's ``flag_value``, which typer does not support,
    would take any next word, e.g. a scenario. Click documents ``parse_args`` for subclasses of commands.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        options_with_optional_value = [
            name
            for parameter in self.params
            if parameter.param_type_name == "option" and (parameter.metavar or "").startswith("[")
            for name in parameter.opts
        ]
        if options_with_optional_value:
            args = _fill_optional_values(args, options_with_optional_value)
        return list(super().parse_args(ctx, args))


def _fill_optional_values(arguments: Sequence[str], options: Sequence[str]) -> list[str]:
    """Return the arguments with ``--web`` as ``--web=``, and ``--web 80`` as ``--web=80``."""
    with_values: list[str] = []
    remaining = list(arguments)
    while remaining and remaining[0] != "--":
        argument = remaining.pop(0)
        if argument in options:
            number = remaining.pop(0) if remaining and remaining[0].isdecimal() else ""
            argument = f"{argument}={number}"
        with_values.append(argument)
    return with_values + remaining


def style(command: Any) -> Any:
    """Give the help of a command and its subcommands the common style; return the command."""
    # an epilog, which the help shows after the options
    description, example_heading, example = (command.help or "").partition(EXAMPLE)
    if example_heading:
        command.help = description
        lines = "\n".join(f"  {line.strip()}" for line in example.strip().splitlines())
        command.epilog = f"{_KEEP_LINES}\nExample:\n{lines}"
    for parameter in command.params:
        _style_parameter(parameter)
    for subcommand in getattr(command, "commands", {}).values():
        style(subcommand)
    return command


def _style_parameter(parameter: Any) -> None:
    if parameter.metavar is None and not getattr(parameter, "is_flag", False):
        parameter.metavar = _choose_metavar(parameter)


def _choose_metavar(parameter: Any) -> str:
    """Return the word for a parameter's value in the help."""
    # the type by the name of its class: typer depends on click or contains a copy of click
    name, type_name = str(parameter.name), type(parameter.type).__name__
    if parameter.param_type_name == "argument":
        return name.upper().replace("_", "-")
    if name in _METAVARS and "Path" not in type_name:
        return _METAVARS[name]
    if "Path" in type_name:
        return "DIR" if _DIRECTORY.search(name) else "FILE"
    if "Float" in type_name or _SECONDS.search(name):
        return "SECONDS" if _SECONDS.search(name) else "N"
    return "N" if "Int" in type_name else "TEXT"
