"""The recorder of a daemon, with numbered recordings and the switch of Fawkes' bblogger."""

from __future__ import annotations

from cxbridge.daemon.daemon import Daemon
from cxbridge.run.recording import RecorderComponent
from cxbridge.trace.recorder import Recorder
from cxbridge.trace.switch import RecordingSwitch


class DaemonRecorder(RecorderComponent):
    """Records all events.

    :raises TraceError: if a file cannot be written.
    """

    def __init__(self, daemon: Daemon) -> None:
        super().__init__(daemon, keep=True)
        self._switch = _make_switch(daemon, self.recorder)

    def close(self) -> None:
        if self._switch is not None:
            self._switch.close()
        super().close()


def _make_switch(daemon: Daemon, recorder: Recorder) -> RecordingSwitch | None:
    """Return the switch by which ``ffbblog enable`` and ``disable`` control bblogger files."""
    if daemon.settings.bblog is None or not daemon.settings.rights.control:
        return None
    from cxbridge.trace.formats.bblogger.writer import BBLoggerWriter  # noqa: PLC0415 - for those who write it

    return RecordingSwitch(
        daemon.board,
        lambda enabled: recorder.enable(enabled, BBLoggerWriter),
        daemon.bus.logger("BBLogger"),
    )
