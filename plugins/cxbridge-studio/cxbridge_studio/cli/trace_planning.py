"""``cxbridge trace planning``: prints the planner calls of a recorded run."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.connect import RunPath, print_notes
from cxbridge.cli.console import say


def planning(
    file: RunPath,
    section: Annotated[
        str,
        typer.Argument(
            metavar="[PART]",
            help="print this part: instances, predicates, goal or plan; by default, all parts",
        ),
    ] = "",
    call: Annotated[
        str,
        typer.Option(
            "--of",
            metavar="ID",
            help="print the call with this id, or the last call for the goal with this id; by default, the "
            "last call",
        ),
    ] = "",
) -> None:
    """Print a request to a planner and its answer, in the format of PlanSys2's terminal.

    Example: cxbridge trace planning out/run.mcap plan
    """
    from cxbridge.trace.formats.registry import open_run
    from cxbridge_studio.explain.planning import SECTIONS, find_answer

    if section and section not in SECTIONS:
        raise typer.BadParameter(f"must be one of {', '.join(SECTIONS)}, not '{section}'", param_hint="PART")
    run = open_run(file)
    answer = find_answer(run, call)
    for line in answer.format_section(section) if section else answer.format_sections():
        say(line)
    print_notes(run.notes, file)
