"""A progress bar for commands that play many runs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from cxbridge.printing import unfiltered_stream


@contextmanager
def show_progress(name: str, total: int) -> Iterator[Callable[[], None]]:
    """Show a progress bar if standard error is a terminal; yield the function to call after each step."""
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(file=unfiltered_stream(sys.stderr)), transient=True) as progress:
        task = progress.add_task(name, total=total)
        yield lambda: progress.advance(task)
