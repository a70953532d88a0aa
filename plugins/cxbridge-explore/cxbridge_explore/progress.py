"""The progress of an exploration: a line of text several times a second, and a page less often."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from cxbridge_explore.graph import Graph

_LINE_PERIOD_S: Final = 0.2  # seconds between two lines
_MIN_PAGE_PAUSE_S: Final = 2.0  # slightly less than the 2.5 s after which the page reloads itself
_PAUSE_FACTOR: Final = 20  # a pause of 20 times the duration of a drawing limits drawing to 5 % of the time


class ProgressReporter:
    """Shows the progress from time to time.

    :param graph: the explored graph.
    :param show_line: shows a line of text; called several times a second.
    :param draw_page: draws the page; called at once, and again after a pause of at least 2 seconds, or of 20
        times the duration of the drawing.
    """

    def __init__(self, graph: Graph, show_line: Callable[[str], None], draw_page: Callable[[], None]) -> None:
        self._graph = graph
        self._show_line = show_line
        self._draw_page = draw_page
        self._next_page_s = 0.0
        self._start_s = self._next_line_s = time.monotonic()

    def show_if_due(self) -> None:
        """Show a line and draw a page if their time has come."""
        now_s = time.monotonic()
        if now_s >= self._next_line_s:
            self._next_line_s = now_s + _LINE_PERIOD_S
            counts, branches = self._graph.counts_text, self._graph.open_branches_text
            self._show_line(f"{counts}, {now_s - self._start_s:.0f} s; {branches}")
        if now_s >= self._next_page_s:
            self._draw_page()
            self._next_page_s = time.monotonic() + max(
                _MIN_PAGE_PAUSE_S, _PAUSE_FACTOR * (time.monotonic() - now_s)
            )
