"""``cxbridge trace report``: a recorded run as one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.console import say


def report(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A recorded run of any format.")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="OUT.html", help="The page to write.")],
    title: Annotated[
        str, typer.Option(help="The heading of the page; by default the name of the file.")
    ] = "",
) -> None:
    """Write a page that shows a run: goals over time, plan-actions, skills, rules, log, interfaces.

    The page is a single file, which any browser opens without a network. See docs/see.md.

    Example: cxbridge trace report out/run.mcap -o out/run.html
    """
    from cxbridge.file_access import write_file
    from cxbridge.trace.formats.registry import open_run
    from cxbridge_web.report import report as make_report

    run = open_run(file)
    if output.exists() and output.samefile(file):
        raise typer.BadParameter("the page would replace the recording", param_hint="--output")
    page = make_report(run, title).encode()
    write_file(output, page)
    say(f"{output}: {len(page) / 1e6:.1f} MB")
    for note in run.notes:
        say(f"{file}: {note}", err=True)
