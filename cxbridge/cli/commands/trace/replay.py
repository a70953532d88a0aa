"""``cxbridge trace replay``: write a recording to a blackboard."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.connect import print_notes
from cxbridge.cli.console import ConsoleOptions, complain, progress_line, say_result
from cxbridge.cli.option_groups import option_groups
from cxbridge.daemon.services.options import ReplayOptions

CONNECTION_LOST = 4
"""The exit status after a lost connection."""

INTERRUPTED = 130
"""The exit status after Ctrl-C, as of a shell: 128 + 2, the number of SIGINT."""


@option_groups
def replay(
    options: ReplayOptions,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
    *,
    console: ConsoleOptions,
) -> int:
    """Write the interfaces of a recording to a blackboard, in recorded time. See docs/recording.md.

    Exit status: 0 all events are written, or Ctrl-C ended --loop; 2 bad input, no server, or an interface has
    another writer; 4 the connection was lost; 130 interrupted before the last event.

    Example: cxbridge trace replay out/run.mcap --speed 2
    """
    from cxbridge.daemon.services import replay as replaying

    start_s = options.start_s
    if start_s is not None and options.end_s is not None and start_s > options.end_s:
        raise typer.BadParameter(f"the end is before the start, at {start_s:g} s", param_hint="--to")
    with progress_line(hidden=console.quiet) as show:
        report = replaying.replay(
            options,
            console=console.make_log(),
            on_progress=lambda report: show(
                f"{report.seconds:.0f} s  {sum(report.write_counts.values())} writes"
            ),
        )
    print_notes(report.notes, options.run)
    say_result(report.to_json(), report.to_lines(), as_json=as_json)
    if report.end == replaying.LOST:
        complain(f"the connection to {options.url} was lost")
        return CONNECTION_LOST
    return INTERRUPTED if report.end == replaying.INTERRUPTED and not options.loop else 0
