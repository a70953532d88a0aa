"""The progress of an exploration: a line of text every moment."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from cxbridge.printing import format_count
from cxbridge_explore.graph import Graph

_LINE_PERIOD_S: Final = 0.2  # seconds between two lines
_MIN_SHARE: Final = 1e-3  # below this share of explored runs, an estimate of the total is meaningless


class ProgressReporter:
    """Shows the progress from time to time.

    :param graph: the explored graph.
    :param show_line: called with the line; None to show no line.
    """

    def __init__(self, graph: Graph, show_line: Callable[[str], None] | None) -> None:
        self._graph = graph
        self._show_line = show_line
        self._start_s = self._next_line_s = time.monotonic()

    def show_if_due(self) -> None:
        """Show a line if its time has come."""
        now_s = time.monotonic()
        if self._show_line is not None and now_s >= self._next_line_s:
            self._next_line_s = now_s + _LINE_PERIOD_S
            self._show_line(self.format_line(now_s - self._start_s))

    def format_line(self, seconds: float) -> str:
        """Return the progress as a line of text.

        :param seconds: the seconds since the start.
        """
        graph = self._graph
        text = f"{graph.counts_text}, {seconds:.0f} s"
        share = graph.explored_share
        if share < _MIN_SHARE:
            return f"{text}; {graph.open_branches_text}"
        return f"{text}; about {100 * share:.0f} % of {format_count(round(len(graph.leaves) / share), 'run')}"
