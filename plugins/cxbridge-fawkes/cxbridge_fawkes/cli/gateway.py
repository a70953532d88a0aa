"""``cxbridge gateway``: mirror interfaces between two blackboards."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.connect import InterfaceDirs
from cxbridge.cli.console import ConsoleOptions
from cxbridge.cli.entry import handle_signals
from cxbridge.cli.option_groups import option_groups

_Url = Annotated[
    str,
    typer.Argument(metavar="URL", help="A blackboard: tcp://HOST:PORT, ipc://FILE or fawkes://HOST[:PORT]."),
]


@option_groups
@handle_signals(is_service=True)
def gateway(
    left: _Url,
    right: _Url,
    interface: Annotated[
        list[str],
        typer.Option(
            "--interface",
            "-i",
            metavar="GLOB",
            help="Interfaces to mirror: TYPE or TYPE::ID with *, ?, []; may be given several times.",
        ),
    ],
    interface_dir: InterfaceDirs = None,
    *,
    console: ConsoleOptions,
) -> int:
    """Mirror interfaces between two blackboards, in the foreground until SIGINT or SIGTERM.

    Each interface is mirrored from the blackboard with its writer to the other one. Messages are sent to the
    writer, through one instance of the gateway for each sender. See docs/daemon.md#the-gateway.

    Exit status: 0 stopped on request; 2 bad input, or a blackboard does not answer.

    Example: cxbridge gateway fawkes://robot tcp://127.0.0.1:1911 -i 'Position3DInterface::*'
    """
    from cxbridge_fawkes.gateway.service import run_gateway

    run_gateway(
        (left, right), interface, interface_dirs=interface_dir or (), console=console.make_log(info=True)
    )
    return 0
