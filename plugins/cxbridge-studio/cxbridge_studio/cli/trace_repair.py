"""``cxbridge trace repair``: repair truncated recordings and wrong headers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.console import say, say_json

if TYPE_CHECKING:
    from cxbridge_studio.repair.recordings import Repair


def repair(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A recorded run.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="OUT",
            help="Write the repaired copy to this file.",
        ),
    ] = None,
    in_place: Annotated[bool, typer.Option("--in-place", help="Repair FILE without a backup.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Report the damage and write nothing.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Repair a recording: a wrong header of bblogger, a truncated mcap file, an incomplete last line.

    Without -o and --in-place, FILE is repaired, and FILE.bak is the old file. A file without damage remains
    unchanged. See docs/formats.md.

    Exit status: 0 repaired, or nothing to repair; 2 unreadable.

    Example: cxbridge trace repair out/run.mcap --dry-run
    """
    if output is not None and in_place:
        raise typer.BadParameter("cannot be combined with --in-place", param_hint="--output")
    if output is not None and not dry_run and output.exists():
        raise typer.BadParameter(f"'{output}' exists already", param_hint="--output")
    report = _repair_file(file, output, in_place=in_place, dry_run=dry_run)
    if as_json:
        say_json({"files": [report]})
    else:
        _print_report(report)


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
    """Write the repaired file, and return its path and that of the backup.

    A file without damage is only copied to ``output``.

    :returns: a path is None if its file is not written.
    """
    if output is not None:
        file_repair.write_copy(output)
        return output, None
    if not file_repair.actions:
        return None, None
    if in_place:
        file_repair.write_copy(file_repair.path)
        return file_repair.path, None
    return file_repair.path, file_repair.write_with_backup()


def _print_report(report: dict[str, Any]) -> None:
    """Print the actions in the format of Fawkes' ffbblog."""
    if not report["actions"]:
        say("Nothing to repair, files are fine")
        return
    say("Repair successful, actions done follow." if report["output"] else "To be repaired, actions follow.")
    for action in report["actions"]:
        say(action)
    if report["backup"]:
        say(f"backup: {report['backup']}")
