"""`cxbridge mcp`: a server for assistants, on stdin and stdout."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.connect import DEFAULT_URL, Connect


def mcp(
    folders: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[FOLDER]...",
            help="Where agents and recordings are; the current folder by default. "
            "The assistant sees no file elsewhere.",
            show_default=False,
        ),
    ] = None,
    connect: Connect = DEFAULT_URL,
    allow: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Let the assistant run, explore, or ask a daemon for this operation. Repeatable.",
            show_default=False,
        ),
    ] = None,
) -> int:
    """Let an assistant look at agents, recordings and a daemon.

    The server speaks the Model Context Protocol on stdin and stdout.

    Without --allow the assistant can only look. A daemon refuses the operations to which its clients have no
    right, whatever is allowed here.

    Exit status: 0 the assistant has ended it; 2 bad usage.

    Example: cxbridge mcp scenarios out --allow run
    """
    from cxbridge_mcp.server import make_server

    make_server(folders or [Path()], connect, allow or []).run("stdio")
    return 0
