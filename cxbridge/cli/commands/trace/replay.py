"""``cxbridge trace replay``: write a recording to a blackboard."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.command_lines import StepKeys
from cxbridge.cli.console import ConsoleOptions, complain, say, say_json
from cxbridge.cli.option_groups import option_groups
from cxbridge.daemon.services.options import ReplayOptions
from cxbridge.printing import unfiltered_stream

if TYPE_CHECKING:
    from cxbridge.daemon.services.replay import ReplayReport
    from cxbridge.trace.replay.moves import ReplayMove

CONNECTION_LOST = 4
"""The exit status after a lost connection."""

INTERRUPTED = 130
"""The exit status after Ctrl-C."""

_CLEAR_LINE = "\r\x1b[K"
_MAX_EVENT_CHARACTERS = 100  # limit of an event, so that its line fits into most terminals


@option_groups
def replay(
    options: ReplayOptions,
    as_json: Annotated[bool, typer.Option("--json", help="print the summary as JSON")] = False,
    *,
    console: ConsoleOptions,
) -> int:
    """Write the interfaces of a recording to a blackboard, in recorded time. See docs/recording.md.

    Exit status: 0 all events are written; 2 bad input, no server, or an interface has another writer; 4 the
    connection was lost; 130 interrupted, but 0 with --loop, and with --hold after the last event.

    Example: cxbridge trace replay out/run.mcap --speed 2
    """
    from cxbridge.daemon.services import replay as replaying
    from cxbridge.daemon.services.service import do_nothing

    start_s, end_s = options.start_s, options.end_s
    if start_s is not None and end_s is not None and start_s > end_s:
        raise typer.BadParameter(f"the end is before the start, at {start_s:g} s", param_hint="--to")
    if options.step and options.loop:
        raise typer.BadParameter("cannot be combined with --step", param_hint="--loop")
    shows_progress = sys.stderr.isatty() and not console.quiet and not options.step
    with StepKeys() if options.step else nullcontext() as keys:
        report = replaying.replay(
            options,
            keys=keys,
            console=console.make_log(),
            on_progress=_show_progress if shows_progress else do_nothing,
            announce=_announce if options.step and not console.quiet else do_nothing,
        )
    if shows_progress:
        unfiltered_stream(sys.stderr).write(_CLEAR_LINE)
    for note in report.notes:
        say(f"{options.run}: {note}", err=True)
    if as_json:
        say_json(report.to_json(), indent=2)
    else:
        for line in report.to_lines():
            say(line)
    if report.end == replaying.LOST:
        complain(f"the connection to {options.url} was lost")
        return CONNECTION_LOST
    return INTERRUPTED if report.end == replaying.INTERRUPTED and not options.loop else 0


def _show_progress(report: ReplayReport) -> None:
    """Show the progress on a terminal."""
    done_count = sum(report.writes.values()) + report.messages + report.undelivered
    round_text = f", round {report.rounds}" if report.rounds > 1 else ""
    total = report.total * max(report.rounds, 1)
    unfiltered_stream(sys.stderr).write(
        f"{_CLEAR_LINE}{report.position_s:.1f} of {report.last_s:.1f} s, {done_count} of {total}{round_text}"
    )
    sys.stderr.flush()


def _announce(move: ReplayMove) -> None:
    """Print the next event of a stepped replay."""
    from cxbridge.trace.listing import describe_event

    text = describe_event(move.event)
    text = text if len(text) <= _MAX_EVENT_CHARACTERS else f"{text[:_MAX_EVENT_CHARACTERS]} ..."
    say(f"{move.at_us / 1e6:12.6f} {text}", err=True)
