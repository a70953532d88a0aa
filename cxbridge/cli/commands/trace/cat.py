"""``cxbridge trace cat``: print the events of a recorded run."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.connect import InterfaceDirs, RunPath, make_registry, print_notes
from cxbridge.cli.console import say_lines


def cat(
    file: RunPath,
    kind: Annotated[
        list[str] | None,
        typer.Option(
            help="Print only events of this kind: log, rule, fact, goal, plan-action, skill, interface, "
            "message, planner, navgraph, loop."
        ),
    ] = None,
    match: Annotated[
        str, typer.Option(help="Print only events whose lines match this regular expression.")
    ] = "",
    interface_dir: InterfaceDirs = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object per line.")] = False,
) -> None:
    """Print the events of a recorded run, one per line, with the seconds since the start of the run.

    Example: cxbridge trace cat out/run.mcap --kind goal
    """
    from cxbridge.trace.formats.registry import open_run
    from cxbridge.trace.listing import event_filter, json_lines, text_lines

    run = open_run(file, make_registry(interface_dir))
    is_selected = event_filter(kind or [], match)
    say_lines((json_lines if as_json else text_lines)(run, is_selected))
    print_notes(run.notes, file)
