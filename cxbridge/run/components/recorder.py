from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge.run.recording import RecordingSubject, start_recording

if TYPE_CHECKING:
    from cxbridge.trace.formats.base import RunWriter


class RecorderComponent(Component):
    """Records events from construction until :meth:`close`.

    :param run: a run, a team or a daemon.
    :param writers: additional receivers of events.
    :raises TraceError: if a file cannot be written.
    """

    hooks = (Hook.POST_LOOP,)
    steady = True

    def __init__(
        self, run: RecordingSubject, writers: Sequence[RunWriter] = (), *, keep: bool = False
    ) -> None:
        self.recorder = start_recording(run, run.options, writers, keep=keep)

    @property
    def fault(self) -> str:
        return str(self.recorder.errors[0]) if self.recorder.errors else ""

    def describe(self, metadata: Mapping[str, str]) -> None:
        """Add metadata to the recording."""
        self.recorder.describe(metadata)

    def loop(self) -> None:
        self.recorder.flush_when_due()

    def check(self) -> None:
        if self.recorder.errors:
            raise self.recorder.errors[0]

    def close(self) -> None:
        self.recorder.close()
