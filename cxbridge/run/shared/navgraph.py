"""The navigation graph of a run: one for skills and rules, so that a blocked edge is blocked for both."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge.config import Configuration
from cxbridge.events import EventBus
from cxbridge.run.paths import RunPaths

if TYPE_CHECKING:
    from cxbridge.navgraph import NavGraph


class SharedNavGraph:
    """Reads the graph for the first who asks."""

    def __init__(self) -> None:
        self._graph: NavGraph | None = None

    def get(self, config: Configuration, paths: RunPaths, bus: EventBus) -> NavGraph:
        """Return the graph that the configuration names.

        :param bus: gets the event of the first reading.
        :raises CxbridgeError: when it names none, or that cannot be read.
        """
        if self._graph is None:
            from cxbridge.navgraph import emit_navgraph  # noqa: PLC0415
            from cxbridge.skiller.make import load_configured_navgraph  # noqa: PLC0415

            self._graph = load_configured_navgraph(config, paths.confdir)
            emit_navgraph(bus, self._graph)
        return self._graph
