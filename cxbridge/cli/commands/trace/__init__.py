"""``cxbridge trace``: look at recorded runs and compare them. Each module here is one of its commands."""

import sys

import typer

from cxbridge.cli.discovery import group_of_commands, rows_of_group

_ORDER = (
    *("diff", "extract", "record", "repair", "replay"),
    *("transitions", "rules", "exchange", "info", "cat", "convert"),
)

app = typer.Typer(
    name="trace",
    cls=group_of_commands(lambda: rows_of_group("trace", sys.modules[__name__]), {"Commands": _ORDER}),
    no_args_is_help=True,
)


@app.callback()
def _trace() -> None:
    """Look at recorded runs, of this program or of Fawkes, and compare them."""
