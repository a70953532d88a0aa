"""Recorded runs as arguments of commands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.console import say

if TYPE_CHECKING:
    from cxbridge.interfaces.registry import InterfaceRegistry

RunPath = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="a recorded run: mcap, text log of Fawkes, transitions text, bblogger files, a bag of ROS 2",
    ),
]


def definitions(interface_dir: list[Path] | None) -> InterfaceRegistry | None:
    """Return a registry of the given folders, or None for the default."""
    if not interface_dir:
        return None
    from cxbridge.interfaces.registry import InterfaceRegistry

    return InterfaceRegistry(interface_dir)


def print_notes(notes: list[str], file: Path) -> None:
    """Print the warnings about a readable file to stderr."""
    for note in notes:
        say(f"{file}: {note}", err=True)
