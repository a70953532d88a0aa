"""``cxbridge trace record``: the bblogger on any blackboard."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.connect import DEFAULT_URL, Connect, InterfaceDirs
from cxbridge.cli.console import complain, say, say_json
from cxbridge.cli.orderly import orderly
from cxbridge.printing import terminal_of

if TYPE_CHECKING:
    from cxbridge.services.record import RecordReport

NOT_WHOLE = 4
"""Exit status when something could not be written."""


@orderly(service=True)
def record(  # noqa: PLR0913, PLR0917  a command has as many options as it has
    interface: Annotated[
        list[str],
        typer.Option(
            "--interface",
            "-i",
            metavar="GLOB",
            help="what to record: TYPE or TYPE::ID with *, ?, []; may be given several times",
        ),
    ],
    output: Annotated[
        list[Path],
        typer.Option(
            "--output",
            "-o",
            metavar="PATH",
            help="FILE.mcap, or a folder for files as Fawkes' bblogger has them; may be given several times",
        ),
    ],
    url: Connect = DEFAULT_URL,
    duration: Annotated[
        float | None, typer.Option(min=0, help="end after so many seconds; else with Ctrl-C")
    ] = None,
    scenario: Annotated[str, typer.Option(help="name of the recording, in bblogger files")] = "record",
    switch: Annotated[
        bool | None,
        typer.Option(
            "--switch/--no-switch",
            help="let 'ffbblog enable' and 'disable' switch it; by default unless URL is a Fawkes",
            show_default=False,
        ),
    ] = None,
    interface_dir: InterfaceDirs = None,
    as_json: Annotated[bool, typer.Option("--json", help="print the summary as JSON")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Log errors only.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log everything.")] = False,
) -> int:
    """Record what is written to interfaces of a blackboard, until --duration is over, SIGINT or SIGTERM.

    Interfaces that come later are recorded, too; a server that restarts is waited for. See docs/recording.md.

    Exit status: 0 recorded; 2 bad input, nobody there, no file can be made; 4 something could not be written.

    Example: cxbridge trace record -i 'SkillerInterface::*' -o out/skiller.mcap --duration 60
    """
    from cxbridge.cli.console import ConsoleLog
    from cxbridge.services.record import RecordOptions, same_output
    from cxbridge.services.record import record as record_board

    if (twice := same_output(output)) is not None:
        raise typer.BadParameter(f"'{twice}' is named twice", param_hint="--output")
    options = RecordOptions(
        url=url,
        patterns=tuple(interface),
        outputs=tuple(output),
        scenario=scenario,
        duration_s=duration,
        switch=switch,
        interface_dirs=tuple(interface_dir or ()),
    )
    shows = sys.stderr.isatty() and not quiet
    report = record_board(
        options,
        console=ConsoleLog(quiet=quiet, verbose=verbose, info=True),
        on_progress=_show if shows else lambda _report: None,
    )
    if shows:
        terminal_of(sys.stderr).write(_CLEAR)
    if as_json:
        say_json(report.plain(), indent=2)
    else:
        for line in report.lines():
            say(line)
    for error in report.errors:
        complain(error)
    return NOT_WHOLE if report.errors else 0


_CLEAR = "\r\x1b[K"


def _show(report: RecordReport) -> None:
    """Show on one line of the terminal how far it is; the next line of the log comes after it."""
    count = sum(report.writes.values())
    terminal_of(sys.stderr).write(
        f"{_CLEAR}{report.seconds:.0f} s  {count} writes of {len(report.writes)} interfaces\r"
    )
    sys.stderr.flush()
