"""The components of a daemon that start first: its blackboard, and its recorder."""

from __future__ import annotations

from cxbridge.daemon.daemon import Daemon
from cxbridge.run.components.component import Component
from cxbridge.run.recording import RecorderComponent


class BlackBoardComponent(Component):
    """Starts first, and therefore closes the blackboard and the run's shared objects last."""

    steady = True  # clients open interfaces while the daemon is paused or reset

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon

    def close(self) -> None:
        self._daemon.release()


class DaemonRecorder(RecorderComponent):
    """Records the events of a daemon; earlier recordings of the same name are kept.

    :raises CxbridgeError: if a file cannot be written.
    """

    def __init__(self, daemon: Daemon) -> None:
        super().__init__(daemon, keep=True)
