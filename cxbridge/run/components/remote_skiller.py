"""A Skiller on another blackboard as a component."""

from __future__ import annotations

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.run.components.component import Component
from cxbridge.run.components.skillers import Skillers
from cxbridge.run.context import RunContext
from cxbridge.run.remote_skiller import PATIENCE_S, RemoteSkiller


class RemoteSkillers(Component):
    """Mirrors the Skiller of the blackboard at a URL.

    A run waits for the Skiller, and ends when it is gone; a daemon does without it until it comes.

    :raises CxbridgeError: when nobody is at the URL, or in time no Skiller.
    """

    description = Skillers.description

    def __init__(self, context: RunContext) -> None:
        def open_there(url: str) -> BlackBoard:
            return open_blackboard(url, context.registry, context.clock, context.bus)

        self._remote = RemoteSkiller(
            context.options.skiller,
            context.board,
            context.bus,
            open_there,
            patience_s=PATIENCE_S if context.waits_for_skiller else 0,
        )

    @property
    def loss(self) -> str:
        """Why the run cannot go on."""
        return self._remote.loss

    def close(self) -> None:
        """Leave both blackboards."""
        self._remote.close()
