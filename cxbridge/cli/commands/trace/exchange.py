"""``cxbridge trace exchange``: print the messages of a skill board."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.connect import InterfaceDirs, RunPath, make_registry, print_notes
from cxbridge.cli.console import say_lines


def exchange(
    file: RunPath,
    interface_dir: InterfaceDirs = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object per line.")] = False,
) -> None:
    """Print the messages of masters and executors on a skill board, one per line, in recorded order.

    Example: cxbridge trace exchange out/run.mcap
    """
    from cxbridge.trace.exchange_lines import exchange_json_lines, exchange_lines
    from cxbridge.trace.formats.registry import open_run

    run = open_run(file, make_registry(interface_dir))
    say_lines((exchange_json_lines if as_json else exchange_lines)(run))
    print_notes(run.notes, file)
