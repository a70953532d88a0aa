"""``cxbridge trace info``: summarise a recorded run."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.connect import InterfaceDirs, RunPath, make_registry, print_notes
from cxbridge.cli.console import say, say_json


def info(
    file: RunPath,
    interface_dir: InterfaceDirs = None,
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object")] = False,
) -> None:
    """Show the content of a recording: format, times, number of events by kind, metadata, attached files.

    Example: cxbridge trace info out/run.mcap
    """
    from cxbridge.trace.formats.registry import open_run
    from cxbridge.trace.summary import summarise

    run = open_run(file, make_registry(interface_dir))
    summary = summarise(run)
    if as_json:
        say_json(summary.to_json())
    else:
        for line in summary.to_lines():
            say(line)
    print_notes(run.notes, file)
