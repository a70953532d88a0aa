"""The options of a process that works on a blackboard: where it is, and the definitions of its interfaces."""

from __future__ import annotations

import typer

CONNECT = typer.Option(
    "--connect",
    metavar="URL",
    envvar="CXBRIDGE_CONNECT",
    help="the blackboard: tcp://HOST:PORT or ipc://FILE of a daemon, fawkes://HOST[:PORT] of a Fawkes; "
    "tcp://HOST:PORT?key=FILE&server-key=FILE with CURVE keys",
)
INTERFACE_DIR = typer.Option(
    "--interface-dir",
    metavar="DIR",
    help="look for interface definitions here before cxbridge's own; may be given several times",
)
