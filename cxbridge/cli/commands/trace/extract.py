"""``cxbridge trace extract``: the files that were recorded with a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.connect import print_notes
from cxbridge.cli.console import say, say_lines


def extract(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A recorded run (mcap).")],
    pattern: Annotated[
        str, typer.Argument(metavar="PATTERN", help="Write only the files whose names match, e.g. 'clips/*'.")
    ] = "*",
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="DIR", help="Folder for the files, created if missing."),
    ] = Path(),
) -> None:
    """Write the files that were recorded with a run (configuration, CLIPS, PDDL, interfaces) to a folder.

    Exit status: 0 written; 1 no file matches.

    Example: cxbridge trace extract out/run.mcap 'clips/*' -o out/files
    """
    from cxbridge.trace.formats.registry import open_run
    from cxbridge.trace.sources import extract_files

    run = open_run(file)
    say_lines(paths := extract_files(run, output, pattern))
    print_notes(run.notes, file)
    if not paths:
        say(f"{file}: no file in it matches '{pattern}'", err=True)
        raise typer.Exit(1)
