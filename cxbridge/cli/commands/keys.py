"""``cxbridge keys``: make CURVE keys for a daemon or a client."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.console import say_lines


def keys(
    name: Annotated[
        str, typer.Argument(help="Name of the owner; the files are NAME.key and NAME.key_secret.")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for the files.")
    ] = Path(),
) -> None:
    """Generate a pair of CURVE keys for ZeroMQ connections between machines, and print both paths.

    NAME.key is public. NAME.key_secret stays on its host, where only its user can read it.

    Example: cxbridge keys robot -o keys
    """
    from cxbridge.blackboard.zmq.keyfiles import create_keys

    say_lines(create_keys(output, name))
