"""``cxbridge trace repair``: repair truncated recordings and wrong headers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.console import complain, say, say_json

if TYPE_CHECKING:
    from cxbridge_studio.repair.recordings import Repair

UNREADABLE = 2
"""The exit status if a file is not a recording, or cannot be read, repaired or written."""


def repair(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="a recorded run, or a folder of such files")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="OUT",
            help="write the repaired copy to this file; if FILE is a folder, into this folder",
        ),
    ] = None,
    in_place: Annotated[bool, typer.Option("--in-place", help="repair FILE without a backup")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="report the damage and write nothing")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object")] = False,
) -> int:
    """Repair a recording: a wrong header of bblogger, a truncated mcap file, an incomplete last line.

    Without -o and --in-place, FILE is repaired, and FILE.bak is the old file. A file without damage remains
    unchanged. See docs/formats.md.

    Exit status: 0 repaired, or nothing to repair; 2 unreadable.

    Example: cxbridge trace repair out/run.mcap --dry-run
    """
    from cxbridge.errors import CxbridgeError
    from cxbridge_studio.repair.recordings import find_recordings

    if output is not None and in_place:
        raise typer.BadParameter("cannot be combined with --in-place", param_hint="--output")
    if output is not None and not dry_run and output.exists() and not (file.is_dir() and output.is_dir()):
        raise typer.BadParameter(f"'{output}' exists already", param_hint="--output")
    status = 0
    results = []
    files = list(find_recordings(file)) if file.is_dir() else [file]
    if not files:
        raise typer.BadParameter("no recording in this folder", param_hint="FILE")
    if output is not None and file.is_dir() and not dry_run:
        output.mkdir(exist_ok=True)
    for path in files:
        target = output / path.name if output is not None and file.is_dir() else output
        try:
            results.append(_repair_file(path, target, in_place=in_place, dry_run=dry_run))
        except CxbridgeError as error:
            if not file.is_dir():
                raise
            # the other files of the folder are repaired nevertheless
            complain(error)
            results.append({"path": str(path), "error": error.message})
            status = UNREADABLE
    if as_json:
        say_json({"files": results})
    else:
        for result in results:
            _print_result(result, with_path=file.is_dir())
    return status


def _repair_file(path: Path, output: Path | None, *, in_place: bool, dry_run: bool) -> dict[str, Any]:
    """Repair one file, and return the report as a JSON object."""
    from cxbridge_studio.repair.recordings import check_events, examine

    file_repair = examine(path)
    if not file_repair.actions:
        check_events(path)  # only a file that can be read to its end is reported as fine
    written_path, backup_path = (
        (None, None) if dry_run else _write_repair(file_repair, output, in_place=in_place)
    )
    if written_path is not None:
        check_events(written_path)
    return {
        "path": str(path),
        "format": file_repair.format,
        "actions": file_repair.actions,
        "repaired": written_path is not None and bool(file_repair.actions),
        "output": None if written_path is None else str(written_path),
        "backup": None if backup_path is None else str(backup_path),
    }


def _write_repair(
    file_repair: Repair, output: Path | None, *, in_place: bool
) -> tuple[Path | None, Path | None]:
    """Write the repaired file; return its path and the path of the backup, each None without the file."""
    if output is not None:
        file_repair.write_copy(output)
        return output, None
    if not file_repair.actions:
        return None, None
    if in_place:
        file_repair.write_copy(file_repair.path)
        return file_repair.path, None
    return file_repair.path, file_repair.write_with_backup()


def _print_result(result: dict[str, Any], *, with_path: bool) -> None:
    """Print the actions in the format of Fawkes' ffbblog."""
    if "error" in result:
        return
    if with_path:
        say(f"{result['path']}:")
    if not result["actions"]:
        say("Nothing to repair, files are fine")
        return
    say("Repair successful, actions done follow." if result["output"] else "To be repaired, actions follow.")
    for action in result["actions"]:
        say(action)
    if result["backup"]:
        say(f"backup: {result['backup']}")
