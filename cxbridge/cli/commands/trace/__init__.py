"""``cxbridge trace``: look at recorded runs and compare them. Each module here is one of its commands."""

from typing import Final

import typer

from cxbridge.cli.discovery import group_of_modules

HELP_ORDER: Final = (
    *("diff", "extract", "record", "repair", "replay", "report", "timeline"),
    *("transitions", "rules", "exchange", "planning", "info", "cat", "convert"),
)

app = typer.Typer(name="trace", cls=group_of_modules(__name__), no_args_is_help=True)


@app.callback()
def _trace() -> None:
    """Look at recorded runs, of this program or of Fawkes, and compare them."""
