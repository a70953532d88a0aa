"""The navigation graph of a run: one for skills and rules, so that a blocked edge is blocked for both."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge.config import Configuration
from cxbridge.run.paths import Places

if TYPE_CHECKING:
    from cxbridge.navgraph import NavGraph


class SharedNavGraph:
    """Reads the graph for the first who asks."""

    def __init__(self) -> None:
        self._graph: NavGraph | None = None

    def get(self, config: Configuration, places: Places) -> NavGraph:
        """Return the graph that the configuration names.

        :raises CxbridgeError: when it names none, or that cannot be read.
        """
        if self._graph is None:
            from cxbridge.skiller.make import load_configured_navgraph  # noqa: PLC0415

            self._graph = load_configured_navgraph(config, places.config_file.parent)
        return self._graph
