"""``cxbridge trace planning``."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.connect import RunPath, print_notes
from cxbridge.cli.console import say


def planning(
    file: RunPath,
    part: Annotated[
        str, typer.Argument(metavar="[PART]", help="instances, predicates, goal or plan; all by default")
    ] = "",
    of: Annotated[str, typer.Option(metavar="ID", help="of this call or goal; by default the last")] = "",
) -> None:
    """Print the requests to a planner and its answers, in the form of PlanSys2's terminal.

    Example: cxbridge trace planning out/run.mcap plan
    """
    from cxbridge.trace.formats.registry import open_run
    from cxbridge_studio.explain.planning import PARTS, choose_answer

    if part and part not in PARTS:
        raise typer.BadParameter(f"'{part}' is none of {', '.join(PARTS)}", param_hint="PART")
    run = open_run(file)
    answer = choose_answer(run, of)
    for line in answer.section(part) if part else answer.as_terminal():
        say(line)
    print_notes(run.notes, file)
