"""How far an exploration is, on a terminal: one line that is written over."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from cxbridge_explore.graph import Graph

_PERIOD_S: Final = 0.2
_LEAST_SHARE: Final = 1e-3
"""Below it, an estimate of the whole says nothing."""


class ProgressReporter:
    """Says now and then how far it is.

    :param graph: the known graph.
    :param show: gets the line; None: no progress is shown.
    """

    def __init__(self, graph: Graph, show: Callable[[str], None] | None) -> None:
        self._graph = graph
        self._show = show
        self._begin = self._next = time.monotonic()

    def tick(self) -> None:
        """Say it, if it is time to."""
        now = time.monotonic()
        if self._show is not None and now >= self._next:
            self._next = now + _PERIOD_S
            self._show(self.line(now - self._begin))

    def line(self, seconds: float) -> str:
        """Return how far it is.

        :param seconds: since the beginning.
        """
        graph = self._graph
        text = f"{len(graph.leaves)} runs, {len(graph.nodes)} states, {graph.merged} merged, {seconds:.0f} s"
        share = graph.explored
        if share < _LEAST_SHARE:
            return f"{text}; {len(graph.open)} branches are open"
        return f"{text}; about {100 * share:.0f} % of {round(len(graph.leaves) / share)} runs"
