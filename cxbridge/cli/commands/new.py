"""`cxbridge new`: make an agent with a test, a workflow for CI and a launch file for VS Code."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.console import say
from cxbridge.errors import CxbridgeError


def new(
    folder: Annotated[
        Path, typer.Argument(metavar="NAME", help="The project's folder; its name is the agent's.")
    ],
    from_fawkes: Annotated[
        str | None,
        typer.Option(metavar="SPEC", help="Begin from this spec of a Fawkes checkout.", show_default=False),
    ] = None,
    fawkes_dir: Annotated[
        Path | None,
        typer.Option(envvar="FAWKES_DIR", help="With --from-fawkes: the checkout.", show_default=False),
    ] = None,
    from_ros2cx: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Begin from a checkout of ros2-clips-executive (2021).", show_default=False
        ),
    ] = None,
) -> None:
    """Make an agent with a test, a workflow for CI and a launch file for VS Code.

    By default it is the agent of the tutorial. An agent that there is already stays in its checkout: the
    project names it, with a configuration on top. No file that is there is overwritten.

    Example: cxbridge new courier
    """
    from cxbridge.testing.new_project import new_agent, new_agent_of_fawkes, new_agent_of_ros2cx

    if from_fawkes is not None and from_ros2cx is not None:
        raise CxbridgeError("--from-fawkes and --from-ros2cx cannot go together")
    if from_ros2cx is not None:
        files = new_agent_of_ros2cx(folder, from_ros2cx)
    elif from_fawkes is None:
        files = new_agent(folder)
    elif fawkes_dir is None:
        raise CxbridgeError("--from-fawkes needs a checkout", hint="name it with --fawkes-dir")
    else:
        files = new_agent_of_fawkes(folder, fawkes_dir, from_fawkes)
    for file in files:
        say(file)
    say(f"next: cd {shlex.quote(str(folder))}, see README.md")
