"""`cxbridge new`: make an agent with a test, a workflow for CI and a launch file for VS Code."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.console import say, say_lines
from cxbridge.cli.option_groups import option_groups
from cxbridge.testing.new_project import NewOptions


@option_groups
def new(
    folder: Annotated[
        Path,
        typer.Argument(metavar="NAME", help="Folder of the project; its name becomes the name of the agent."),
    ],
    options: NewOptions,
) -> None:
    """Make an agent with a test, a workflow for CI and a launch file for VS Code.

    Without an option that names an existing agent, the project gets the agent of the tutorial. An existing
    agent remains in its checkout: the project refers to the agent, and adds a configuration. Existing files
    are not overwritten.

    Example: cxbridge new courier
    """
    from cxbridge.testing.new_project import make_project

    say_lines(make_project(folder, options))
    say(f"next: cd {shlex.quote(str(folder))}, see README.md")
