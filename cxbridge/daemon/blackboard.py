"""The component with the blackboard and the robot memory of a daemon."""

from __future__ import annotations

from cxbridge.daemon.daemon import Daemon
from cxbridge.run.components.component import Component


class BlackBoardComponent(Component):
    """Closes the blackboard and the robot memory after all other components."""

    steady = True

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon

    def close(self) -> None:
        self._daemon.release()
