"""The recorder of a daemon: it keeps earlier recordings, and serves the switch of Fawkes' bblogger."""

from __future__ import annotations

from cxbridge.daemon.daemon import Daemon
from cxbridge.run.components.recorder import RecorderComponent
from cxbridge.trace.recorder import Recorder
from cxbridge.trace.switch import RecordingSwitch


class DaemonRecorder(RecorderComponent):
    """Records everything that happens.

    :raises TraceError: when a file cannot be written.
    """

    def __init__(self, daemon: Daemon) -> None:
        super().__init__(daemon, keep=True)
        self._switch = _make_switch(daemon, self.recorder)

    def close(self) -> None:
        """Finish the files."""
        if self._switch is not None:
            self._switch.close()
        super().close()


def _make_switch(daemon: Daemon, recorder: Recorder) -> RecordingSwitch | None:
    """Let ``ffbblog enable`` and ``disable`` switch what Fawkes' bblogger would write."""
    if daemon.settings.bblog is None or not daemon.settings.rights.control:
        return None
    from cxbridge.trace.formats.bblogger.writer import BBLoggerWriter  # noqa: PLC0415 - for those who write it

    return RecordingSwitch(
        daemon.board,
        lambda enabled: recorder.enable(enabled, BBLoggerWriter),
        daemon.bus.logger("BBLogger"),
    )
