"""The recorder of a daemon as a component: from before the others begin until after they have ended."""

from __future__ import annotations

from cxbridge.daemon.daemon import Daemon
from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge.run.recording import start_recording
from cxbridge.trace.recorder import Recorder
from cxbridge.trace.switch import RecordingSwitch


class RecorderComponent(Component):
    """Records everything that happens.

    :raises TraceError: when a file cannot be written.
    """

    hooks = (Hook.POST_LOOP,)
    steady = True

    def __init__(self, daemon: Daemon) -> None:
        self._recorder = start_recording(daemon, daemon.options, keep=True)
        self._switch = _make_switch(daemon, self._recorder)

    def loop(self) -> None:
        """Bring what was recorded into the files, now and then."""
        self._recorder.flush_when_due()

    def check(self) -> None:
        """Raise when something could not be recorded."""
        if self._recorder.errors:
            raise self._recorder.errors[0]

    def close(self) -> None:
        """Finish the files."""
        if self._switch is not None:
            self._switch.close()
        self._recorder.close()


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
