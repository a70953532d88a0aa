"""`cxbridge new`: make an agent with a test, a workflow for CI and a launch file for VS Code."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.console import say
from cxbridge.cli.option_groups import option_groups
from cxbridge.testing.new_project import NewOptions


@option_groups
def new(
    folder: Annotated[
        Path, typer.Argument(metavar="NAME", help="The project's folder; its name is the agent's.")
    ],
    options: NewOptions,
) -> None:
    """Make an agent with a test, a workflow for CI and a launch file for VS Code.

    By default it is the agent of the tutorial. An agent that there is already stays in its checkout: the
    project names it, with a configuration on top. No file that is there is overwritten.

    Example: cxbridge new courier
    """
    from cxbridge.testing.new_project import make_project

    for file in make_project(folder, options):
        say(file)
    say(f"next: cd {shlex.quote(str(folder))}, see README.md")
