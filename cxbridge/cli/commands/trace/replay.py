"""``cxbridge trace replay``: a recording onto any blackboard."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.connect import DEFAULT_URL, Connect, InterfaceDirs
from cxbridge.cli.console import complain, say, say_json
from cxbridge.printing import terminal_of

if TYPE_CHECKING:
    from cxbridge.services.replay import ReplayReport
    from cxbridge.trace.replay.moves import Move

LOST = 4
"""Exit status when the connection was lost."""

INTERRUPTED = 130
_CLEAR = "\r\x1b[K"
_LONGEST = 100


def replay(  # noqa: PLR0913, PLR0917  a command has as many options as it has
    run: Annotated[Path, typer.Argument(metavar="RUN", help="mcap, or a file or folder of bblogger")],
    url: Connect = DEFAULT_URL,
    interface: Annotated[
        list[str] | None,
        typer.Option(
            "--interface",
            "-i",
            metavar="GLOB",
            help="what to replay: TYPE or TYPE::ID with *, ?, []; may be given several times; by default all",
        ),
    ] = None,
    messages: Annotated[
        bool, typer.Option("--messages", help="send recorded messages to interfaces that are not replayed")
    ] = False,
    speed: Annotated[
        float, typer.Option(min=1e-6, max=1e6, help="so many seconds of the recording in one")
    ] = 1.0,
    step: Annotated[
        bool, typer.Option("--step", help="one write a key; without a terminal, a line on stdin")
    ] = False,
    start: Annotated[
        float | None,
        typer.Option("--from", min=0, metavar="S", help="begin so many seconds after the first event"),
    ] = None,
    end: Annotated[
        float | None,
        typer.Option("--to", min=0, metavar="S", help="end so many seconds after the first event"),
    ] = None,
    restamp: Annotated[
        bool, typer.Option("--restamp", help="stamp writes with the time of now, not the recorded one")
    ] = False,
    loop: Annotated[bool, typer.Option("--loop", help="from the start again, until Ctrl-C")] = False,
    hold: Annotated[bool, typer.Option("--hold", help="stay the writer at the end, until Ctrl-C")] = False,
    interface_dir: InterfaceDirs = None,
    as_json: Annotated[bool, typer.Option("--json", help="print the summary as JSON")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Log errors only.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log everything.")] = False,
) -> int:
    """Write the interfaces of a recording to a blackboard, in recorded time. See docs/replay.md.

    Exit status: 0 all is written; 2 bad input, somebody else writes an interface, nobody there; 4 the
    connection was lost; 130 interrupted, but with --loop and --hold 0.
    """
    from cxbridge.cli.console import ConsoleLog
    from cxbridge.process.stepping import StepKeys
    from cxbridge.services import replay as replaying

    if start is not None and end is not None and start > end:
        raise typer.BadParameter(f"it ends before it begins, at {start:g} s", param_hint="--to")
    if step and loop:
        raise typer.BadParameter("cannot go with --step", param_hint="--loop")
    with ExitStack() as stack:
        options = replaying.ReplayOptions(
            run=run,
            url=url,
            patterns=tuple(interface or ()),
            messages=messages,
            speed=speed,
            keys=stack.enter_context(StepKeys()) if step else None,
            start_s=start,
            end_s=end,
            restamp=restamp,
            loop=loop,
            hold=hold,
            interface_dirs=tuple(interface_dir or ()),
        )
        shows = sys.stderr.isatty() and not quiet and not step
        report = replaying.replay(
            options,
            console=ConsoleLog(quiet=quiet, verbose=verbose),
            on_progress=_show if shows else lambda _report: None,
            announce=_announce if step and not quiet else lambda _move: None,
        )
    if shows:
        terminal_of(sys.stderr).write(_CLEAR)
    for note in report.notes:
        say(f"{run}: {note}", err=True)
    if as_json:
        say_json(report.plain(), indent=2)
    else:
        for line in report.lines():
            say(line)
    if report.end == replaying.LOST:
        complain(f"the connection to {url} was lost")
        return LOST
    return INTERRUPTED if report.end == replaying.INTERRUPTED and not loop else 0


def _show(report: ReplayReport) -> None:
    """Show on a terminal how far it is."""
    done = sum(report.writes.values()) + report.messages + report.undelivered
    again = f", round {report.rounds}" if report.rounds > 1 else ""
    total = report.total * max(report.rounds, 1)
    terminal_of(sys.stderr).write(
        f"{_CLEAR}{report.position_s:.1f} of {report.last_s:.1f} s, {done} of {total}{again}"
    )
    sys.stderr.flush()


def _announce(move: Move) -> None:
    """Tell what the next key will write."""
    from cxbridge.trace.listing import describe

    text = describe(move.event)
    text = text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."
    say(f"{move.at_us / 1e6:12.6f} {text}", err=True)
