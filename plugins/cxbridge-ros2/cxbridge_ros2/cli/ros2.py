"""The command ``cxbridge ros2``: a package for machines with ROS 2, and a prompt for PlanSys2's experts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.commands.interface import DefinitionDirs, make_checked_registry
from cxbridge.cli.console import say
from cxbridge.resources import shipped_interfaces

app = typer.Typer(name="ros2", no_args_is_help=True)


@app.callback()
def _ros2() -> None:
    """Make a package for machines with ROS 2, and talk to the experts of PlanSys2."""


@app.command()
def package(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME...]",
            help="The interface types that get messages; by default, all types.",
            autocompletion=shipped_interfaces,
        ),
    ] = None,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="DIR", help="The folder for the package, e.g. workspace/src."),
    ] = Path(),
    interface_dir: DefinitionDirs = None,
) -> None:
    """Write the ROS package cxbridge_msgs, which has messages for interfaces; build it with colcon.

    Example: cxbridge ros2 package -o workspace/src SkillerInterface Position3DInterface
    """
    from cxbridge_ros2.interfaces.package import write_package

    registry = make_checked_registry(interface_dir)
    schemas = [registry.schema(name) for name in names or registry.names()]
    say(write_package(schemas, output))


@app.command()
def terminal(
    command: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[COMMAND...]",
            help="Carry out this command; by default, the commands of a prompt or a pipe.",
        ),
    ] = None,
    transport: Annotated[
        str, typer.Option(help="Reach the experts over this transport: dds, rclpy or rosbridge.")
    ] = "",
    url: Annotated[str, typer.Option(help="The URL of the rosbridge.")] = "",
    domain: Annotated[int | None, typer.Option(min=0, help="The DDS domain of the experts.")] = None,
    reach: Annotated[
        str, typer.Option(help="Find experts on this machine (localhost), or also in the network (subnet).")
    ] = "",
    namespace: Annotated[str, typer.Option(help="The prefix of the experts' names, e.g. /robot1.")] = "",
    distribution: Annotated[
        str, typer.Option(help="The experts' distribution: humble, iron, jazzy ...")
    ] = "",
) -> int:
    """View and edit the domain and the problem with the commands of plansys2_terminal.

    The experts may be those of an agent of cxbridge (ros2: experts:), or PlanSys2's own. The command help
    lists all commands.

    Exit status: 0 done, 1 the experts refused a command, 2 the command is unknown, or there is no server.

    Example: cxbridge ros2 terminal get problem predicates
    """
    from cxbridge_ros2.cli.prompt import run_terminal

    node_options: dict[str, object] = {
        "transport": transport,
        "url": url,
        "domain": domain,
        "reach": reach,
        "namespace": namespace,
        "distribution": distribution,
    }
    # without the unset options, for which the settings have defaults
    settings = {name: value for name, value in node_options.items() if value not in ("", None)}
    return run_terminal(settings, " ".join(command) if command else None)
