"""``cxbridge trace record``: record a blackboard, as Fawkes' bblogger does."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.console import ConsoleOptions, complain, progress_line, say_result
from cxbridge.cli.entry import handle_signals
from cxbridge.cli.option_groups import option_groups
from cxbridge.daemon.services.options import RecordOptions

INCOMPLETE = 4
"""The exit status after a failed write."""


@option_groups
@handle_signals(is_service=True)
def record(
    options: RecordOptions,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
    *,
    console: ConsoleOptions,
) -> int:
    """Record the writes to interfaces of a blackboard, until the end of --duration or a signal (Ctrl-C).

    Interfaces that are opened later are recorded, too. If the server restarts, the recording continues after
    the reconnection. See docs/recording.md.

    Exit status: 0 recorded; 2 bad input, no server, or a file cannot be created; 4 a write failed.

    Example: cxbridge trace record -i 'SkillerInterface::*' -o out/skiller.mcap --duration 60
    """
    from cxbridge.daemon.services.record import find_duplicate_output
    from cxbridge.daemon.services.record import record as record_board

    if (duplicate := find_duplicate_output(options.outputs)) is not None:
        raise typer.BadParameter(f"'{duplicate}' is named twice", param_hint="--output")
    with progress_line(hidden=console.quiet) as show:
        report = record_board(
            options,
            console=console.make_log(info=True),
            on_progress=lambda report: show(f"{report.seconds:.0f} s  {report.counts_text}"),
        )
    say_result(report.to_json(), report.to_lines(), as_json=as_json)
    for error in report.errors:
        complain(error)
    return INCOMPLETE if report.errors else 0
