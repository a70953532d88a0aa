"""The components of a daemon that start first: its blackboard, and its recorder."""

from __future__ import annotations

from functools import partial

from cxbridge.daemon.daemon import Daemon
from cxbridge.run.components.component import Component
from cxbridge.run.recording import RecorderComponent
from cxbridge.trace.switch import RecordingSwitch


class BlackBoardComponent(Component):
    """Starts first, and therefore closes the blackboard and the shared objects after all other components."""

    steady = True

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon

    def close(self) -> None:
        self._daemon.release()


class DaemonRecorder(RecorderComponent):
    """Records all events; earlier recordings of the same name are kept.

    :raises TraceError: if a file cannot be written.
    """

    def __init__(self, daemon: Daemon) -> None:
        super().__init__(daemon, keep=True)
        self._switch = self._make_switch(daemon)

    def _make_switch(self, daemon: Daemon) -> RecordingSwitch | None:
        """Return the switch by which ``ffbblog enable`` and ``disable`` control bblogger files."""
        if daemon.settings.bblog is None or not daemon.settings.rights.control:
            return None
        return RecordingSwitch(
            daemon.board,
            partial(self.recorder.enable, only_switchable=True),
            daemon.bus.logger("BBLogger"),
        )

    def close(self) -> None:
        if self._switch is not None:
            self._switch.close()
        super().close()
