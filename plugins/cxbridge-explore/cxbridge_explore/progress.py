"""Progress of an exploration as one line that is overwritten."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from cxbridge_explore.graph import Graph

_PERIOD_S: Final = 0.2  # time between two progress lines
_MIN_PAUSE_S: Final = 2.0  # minimum time between two drawings
_PAUSE_FACTOR: Final = 20  # a pause of 20 times the duration of a drawing limits drawing to 5 % of the time
_MIN_SHARE: Final = 1e-3  # below this share, an estimate of the total is meaningless


class ProgressReporter:
    """Shows progress from time to time.

    :param graph: the explored graph.
    :param show: called with the line; None to show nothing.
    :param draw: called with the graph, less often; None to draw nothing.
    """

    def __init__(
        self,
        graph: Graph,
        show: Callable[[str], None] | None,
        draw: Callable[[Graph], None] | None = None,
    ) -> None:
        self._graph = graph
        self._show = show
        self._draw = draw
        self._next_draw = 0.0
        self._begin = self._next = time.monotonic()

    def tick(self) -> None:
        """Show the progress if it is due."""
        now = time.monotonic()
        if self._show is not None and now >= self._next:
            self._next = now + _PERIOD_S
            self._show(self.line(now - self._begin))
        if self._draw is not None and now >= self._next_draw:
            self._draw(self._graph)
            self._next_draw = time.monotonic() + max(_MIN_PAUSE_S, _PAUSE_FACTOR * (time.monotonic() - now))

    def line(self, seconds: float) -> str:
        """Return the progress as text.

        :param seconds: the seconds since the start.
        """
        graph = self._graph
        text = f"{len(graph.leaves)} runs, {len(graph.nodes)} states, {graph.merged} merged, {seconds:.0f} s"
        share = graph.explored
        if share < _MIN_SHARE:
            return f"{text}; {len(graph.open)} branches are open"
        return f"{text}; about {100 * share:.0f} % of {round(len(graph.leaves) / share)} runs"
