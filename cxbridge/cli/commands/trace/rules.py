"""``cxbridge trace rules``: print the fired rules."""

from __future__ import annotations

from cxbridge.cli.connect import RunPath, print_notes
from cxbridge.cli.console import say_lines


def rules(file: RunPath) -> None:
    """Print the name of the rule of each firing on a line, in recorded order.

    Example: cxbridge trace rules out/run.mcap
    """
    from cxbridge.events import RuleFired
    from cxbridge.trace.formats.registry import open_run

    run = open_run(file)
    say_lines(event.rule for event in run if isinstance(event, RuleFired))
    print_notes(run.notes, file)
