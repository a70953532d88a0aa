"""``cxbridge trace``: look at recorded runs and compare them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli import (
    trace_diff,
    trace_extract,
    trace_record,
    trace_repair,
    trace_replay,
    trace_report,
    trace_timeline,
)
from cxbridge.cli.connect import InterfaceDirs
from cxbridge.cli.console import say, say_json

if TYPE_CHECKING:
    from cxbridge.interfaces.registry import InterfaceRegistry

app = typer.Typer(name="trace", no_args_is_help=True)

RunPath = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="a recorded run: mcap, text log of Fawkes, transitions text, bblogger files",
    ),
]


app.command()(trace_diff.diff)
app.command()(trace_extract.extract)
app.command()(trace_record.record)
app.command()(trace_repair.repair)
app.command()(trace_replay.replay)
app.command()(trace_report.report)
app.command()(trace_timeline.timeline)


@app.callback()
def _trace() -> None:
    """Look at recorded runs, of this program or of Fawkes, and compare them."""


@app.command()
def transitions(file: RunPath) -> None:
    """Print one line a transition of a goal, a plan-action or a skiller, in recorded order."""
    from cxbridge.trace.formats.registry import open_run
    from cxbridge.trace.formats.transitions_text import format_transition
    from cxbridge.transitions import TRANSITION_TYPES

    run = open_run(file)
    for event in run:
        if isinstance(event, TRANSITION_TYPES):
            say(format_transition(event))
    _tell(run.notes, file)


@app.command()
def rules(file: RunPath) -> None:
    """Print the name of one rule a firing, in recorded order."""
    from cxbridge.events import RuleFired
    from cxbridge.trace.formats.registry import open_run

    run = open_run(file)
    for event in run:
        if isinstance(event, RuleFired):
            say(event.rule)
    _tell(run.notes, file)


@app.command()
def exchange(
    file: RunPath,
    interface_dir: InterfaceDirs = None,
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object a line")] = False,
) -> None:
    """Print the messages of masters and executors on a skill board, one a line, in recorded order."""
    from cxbridge.trace.exchange import exchange_json, exchange_lines
    from cxbridge.trace.formats.registry import open_run

    run = open_run(file, _definitions(interface_dir))
    for line in exchange_json(run) if as_json else exchange_lines(run):
        say(line)
    _tell(run.notes, file)


@app.command()
def planning(
    file: RunPath,
    part: Annotated[
        str, typer.Argument(metavar="[PART]", help="instances, predicates, goal or plan; all by default")
    ] = "",
    of: Annotated[str, typer.Option(metavar="ID", help="of this call or goal; by default the last")] = "",
) -> None:
    """Print what a planner was asked and what it answered, in the form of PlanSys2's terminal."""
    from cxbridge.explain.planning import PARTS, choose_answer
    from cxbridge.trace.formats.registry import open_run

    if part and part not in PARTS:
        raise typer.BadParameter(f"'{part}' is none of {', '.join(PARTS)}", param_hint="PART")
    run = open_run(file)
    answer = choose_answer(run, of)
    for line in answer.section(part) if part else answer.as_terminal():
        say(line)
    _tell(run.notes, file)


@app.command()
def info(
    file: RunPath,
    interface_dir: InterfaceDirs = None,
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object")] = False,
) -> None:
    """Tell what a recording holds: format, times, how many events of each kind, metadata, attached files."""
    from cxbridge.trace.formats.registry import open_run
    from cxbridge.trace.summary import summarise

    run = open_run(file, _definitions(interface_dir))
    summary = summarise(run)
    if as_json:
        say_json(summary.plain())
    else:
        for line in summary.lines():
            say(line)
    _tell(run.notes, file)


@app.command()
def cat(
    file: RunPath,
    kind: Annotated[
        list[str] | None,
        typer.Option(
            help="only events of this kind: log, rule, fact, goal, plan-action, skill, interface, message,"
            " planner"
        ),
    ] = None,
    match: Annotated[str, typer.Option(help="only events whose line holds this regular expression")] = "",
    interface_dir: InterfaceDirs = None,
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object a line")] = False,
) -> None:
    """Print the events of a recorded run, one a line, with the seconds since its first event."""
    from cxbridge.trace.formats.registry import open_run
    from cxbridge.trace.listing import event_filter, json_lines, text_lines

    run = open_run(file, _definitions(interface_dir))
    wanted = event_filter(kind or [], match)
    for line in json_lines(run, wanted) if as_json else text_lines(run, wanted):
        say(line)
    _tell(run.notes, file)


@app.command()
def convert(
    file: RunPath,
    output: Annotated[
        Path, typer.Argument(metavar="OUT", help="the file to write; for CSV of several interfaces a folder")
    ],
    to: Annotated[str, typer.Option(help="mcap, foxglove, fawkes-log, transitions or csv")] = "mcap",
    interface_dir: InterfaceDirs = None,
) -> None:
    """Copy a recorded run to a file of another format."""
    from cxbridge.trace.convert import convert
    from cxbridge.trace.formats.registry import copy_formats, open_run

    if to not in (known := copy_formats()):
        raise typer.BadParameter(f"'{to}' is none of {', '.join(known)}", param_hint="--to")
    run = open_run(file, _definitions(interface_dir))
    if output.exists() and output.samefile(file):
        raise typer.BadParameter("a file cannot be converted to itself", param_hint="OUT")
    notes = convert(run, output, to)
    _tell(run.notes, file)
    _tell(notes, output)


def _definitions(interface_dir: list[Path] | None) -> InterfaceRegistry | None:
    """Return who knows the types of interfaces, None when it is as ever."""
    if not interface_dir:
        return None
    from cxbridge.interfaces.registry import InterfaceRegistry

    return InterfaceRegistry(interface_dir)


def _tell(notes: list[str], file: Path) -> None:
    """Tell on stderr what the user should know of a file that could be read nevertheless."""
    for note in notes:
        say(f"{file}: {note}", err=True)
