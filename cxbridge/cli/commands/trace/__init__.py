"""``cxbridge trace``: record, read, replay and compare runs. Each module of this package is a command."""

import sys

import typer

from cxbridge.cli.discovery import group_rows, make_group_class

# The order of the commands in the help.
_COMMAND_NAMES = [
    "diff",
    "extract",
    "record",
    "replay",
    "transitions",
    "rules",
    "exchange",
    "info",
    "cat",
    "convert",
]

app = typer.Typer(
    name="trace",
    cls=make_group_class(lambda: group_rows("trace", sys.modules[__name__]), {"Commands": _COMMAND_NAMES}),
    no_args_is_help=True,
)


@app.callback()
def _trace() -> None:
    """Record, read and compare runs of this program and of Fawkes."""
