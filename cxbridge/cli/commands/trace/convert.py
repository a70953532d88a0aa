"""``cxbridge trace convert``: copy a recorded run to another format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.connect import InterfaceDirs, RunPath, make_registry, print_notes
from cxbridge.errors import CxbridgeError
from cxbridge.plugins import package_hint


def convert(
    file: RunPath,
    output: Annotated[
        Path, typer.Argument(metavar="OUT", help="File to write; a folder for CSV with several interfaces.")
    ],
    to: Annotated[
        str,
        typer.Option(
            help="Write this format: mcap, foxglove, fawkes-log, transitions, csv, rosbag or rosbag-sqlite3."
        ),
    ] = "mcap",
    interface_dir: InterfaceDirs = None,
) -> None:
    """Copy a recorded run to a file of another format.

    Example: cxbridge trace convert out/run.mcap out/run.log --to fawkes-log
    """
    from cxbridge.trace.convert import convert as convert_run
    from cxbridge.trace.formats.registry import copy_formats, open_run

    if to not in (format_names := copy_formats()):
        # a format of a plug-in that is not installed is known by name: the hint says how to install it
        if hint := package_hint(to):
            raise CxbridgeError(f"--to cannot be '{to}'", hint=hint)
        raise typer.BadParameter(f"'{to}' is not one of {', '.join(format_names)}", param_hint="--to")
    run = open_run(file, make_registry(interface_dir))
    if output.exists() and output.samefile(file):
        raise typer.BadParameter("a file cannot be converted to itself", param_hint="OUT")
    notes = convert_run(run, output, to)
    print_notes(run.notes, file)
    print_notes(notes, output)
