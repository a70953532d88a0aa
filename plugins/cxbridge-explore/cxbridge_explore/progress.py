"""The progress of an exploration: a line of text every moment."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from cxbridge_explore.graph import Graph

_LINE_PERIOD_S: Final = 0.2  # seconds between two lines


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
            seconds = now_s - self._start_s
            self._show_line(f"{self._graph.counts_text}, {seconds:.0f} s; {self._graph.open_branches_text}")
