"""``cxbridge trace``: look at recorded runs and compare them."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    name="trace",
    help="Recorded runs, of this program or of Fawkes: look at them, compare them.",
    no_args_is_help=True,
)

RunPath = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="a recorded run: mcap, text log of Fawkes, transitions text, bblogger files",
    ),
]


@app.command()
def transitions(file: RunPath) -> None:
    """Print one line a transition of a goal, a plan-action or a skiller, in recorded order."""
    from cxbridge.trace.formats.registry import open_run
    from cxbridge.trace.formats.transitions_text import format_transition
    from cxbridge.transitions import TRANSITION_TYPES

    run = open_run(file)
    for event in run:
        if isinstance(event, TRANSITION_TYPES):
            print(format_transition(event))
    _tell(run.notes, file)


@app.command()
def rules(file: RunPath) -> None:
    """Print the name of one rule a firing, in recorded order."""
    from cxbridge.events import RuleFired
    from cxbridge.trace.formats.registry import open_run

    run = open_run(file)
    for event in run:
        if isinstance(event, RuleFired):
            print(event.rule)
    _tell(run.notes, file)


def _tell(notes: list[str], file: Path) -> None:
    """Tell on stderr what the user should know of a file that could be read nevertheless."""
    for note in notes:
        print(f"{file}: {note}", file=sys.stderr)
