"""``cxbridge trace timeline``: a recorded run for Perfetto."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.console import say


def timeline(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="a recorded run of any format")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="OUT.json", help="the file to write")],
) -> None:
    """Write a run as Chrome trace events: ui.perfetto.dev and chrome://tracing open it.

    Goals are tracks below their parents', with modes, plans and actions as slices; skills, interfaces, rules
    and log follow; arrows lead from an action to its skill. See docs/see.md.

    Example: cxbridge trace timeline out/run.mcap -o out/run.json
    """
    from cxbridge.trace.formats.registry import open_run
    from cxbridge_web.timeline.export import write_timeline

    run = open_run(file)
    if output.exists() and output.samefile(file):
        raise typer.BadParameter("the timeline would replace the recording", param_hint="--output")
    count, notes = write_timeline(run, output)
    say(f"{output}: {count} trace events")
    for note in notes:
        say(f"{file}: {note}", err=True)
