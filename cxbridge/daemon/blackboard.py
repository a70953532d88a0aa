"""The blackboard and the robot memory of a daemon as a component: there from the first to the last."""

from __future__ import annotations

from cxbridge.daemon.daemon import Daemon
from cxbridge.run.components.component import Component


class BlackBoardComponent(Component):
    """Closes the blackboard and the robot memory at the end."""

    steady = True

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon

    def close(self) -> None:
        """Close the blackboard and the robot memory."""
        self._daemon.release()
