"""``cxbridge trace transitions``: print the changes of state of goals, plan-actions and Skillers."""

from __future__ import annotations

from cxbridge.cli.connect import RunPath, print_notes
from cxbridge.cli.console import say_lines


def transitions(file: RunPath) -> None:
    """Print the transitions of goals, plan-actions and Skillers, one per line, in recorded order.

    Example: cxbridge trace transitions out/run.mcap
    """
    from cxbridge.history.transitions import TRANSITION_TYPES
    from cxbridge.trace.formats.registry import open_run
    from cxbridge.trace.formats.transitions_text import format_transition

    run = open_run(file)
    say_lines(format_transition(event) for event in run if isinstance(event, TRANSITION_TYPES))
    print_notes(run.notes, file)
