"""``cxbridge trace info``: summarise a recorded run."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.connect import InterfaceDirs, RunPath, make_registry, print_notes
from cxbridge.cli.console import say_result


def info(
    file: RunPath,
    interface_dir: InterfaceDirs = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Show the content of a recording: format, times, number of events by kind, metadata, attached files.

    Example: cxbridge trace info out/run.mcap
    """
    from cxbridge.trace.formats.registry import open_run
    from cxbridge.trace.summary import summarise

    run = open_run(file, make_registry(interface_dir))
    summary = summarise(run)
    say_result(summary.to_json(), summary.to_lines(), as_json=as_json, indent=None)
    print_notes(run.notes, file)
