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
            help="Folder with agents and recordings; the current folder by default. "
            "The assistant sees no files outside of these folders.",
            show_default=False,
        ),
    ] = None,
    connect: Connect = DEFAULT_URL,
    allow: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Allow the assistant to call run, explore, or this operation of a daemon. Repeatable.",
            show_default=False,
        ),
    ] = None,
) -> int:
    """Let an assistant look at agents, recordings and a daemon.

    The server speaks the Model Context Protocol on stdin and stdout.

    Without --allow the assistant can only read. A daemon refuses the operations to which its clients have no
    right, even if --allow names them.

    Exit status: 0 the assistant has closed the connection; 2 bad usage.

    Example: cxbridge mcp scenarios out --allow run
    """
    from cxbridge_mcp.server import make_server

    make_server(folders or [Path()], connect, allow or []).run("stdio")
    return 0
