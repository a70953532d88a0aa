"""``cxbridge ros2``: what machines with ROS 2 get from here."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.commands.interface import InterfaceDirs, registry_of
from cxbridge.cli.console import say
from cxbridge.resources import shipped_interfaces

app = typer.Typer(name="ros2", no_args_is_help=True)


@app.callback()
def _ros2() -> None:
    """Make packages for machines with ROS 2."""


@app.command()
def package(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME...]", help="interface types; all without", autocompletion=shipped_interfaces
        ),
    ] = None,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="DIR", help="folder for both, e.g. a workspace's src"),
    ] = Path(),
    interface_dir: InterfaceDirs = None,
) -> None:
    """Write two ROS packages: cxbridge_msgs has messages for interfaces, cxbridge starts this program.

    Build them with colcon. Then ros2 run cxbridge cxbridge, and ros2 launch cxbridge daemon.launch.py work.

    Example: cxbridge ros2 package -o workspace/src SkillerInterface Position3DInterface
    """
    from cxbridge.ros2.interfaces.package import write_packages

    registry = registry_of(interface_dir)
    schemas = [registry.schema(name) for name in names or registry.names()]
    for folder in write_packages(schemas, output):
        say(folder)
