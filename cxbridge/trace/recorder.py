"""Listens to a run and writes what happens to files."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Mapping, Sequence

from cxbridge.closing import Closing
from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, EventBus
from cxbridge.trace.formats.base import Attachment, RunWriter

_log = logging.getLogger(__name__)

_FLUSH_SECONDS = 0.5


class Recorder(Closing):
    """Writes the events of a bus to any number of files, until it is closed. A context manager.

    A writer that fails (a full disk) gets no more events and does not stop the run: :attr:`errors` has the
    reason. Events may come from several threads; a writer sees one at a time.

    :param bus: the bus of the run.
    :param writers: where to write; the recorder closes them.
    :param level: how much to record. A text log takes facts and firings at every level.
    """

    def __init__(
        self, bus: EventBus, writers: Sequence[RunWriter], level: RecordLevel = RecordLevel.TRANSITIONS
    ) -> None:
        self.errors: list[TraceError] = []
        self._bus = bus
        self._flush_due = 0.0
        self._outputs = [_Output(self, writer) for writer in writers]
        for output in self._outputs:
            bus.subscribe(output.take, *output.writer.event_types(level))

    def describe(self, metadata: Mapping[str, str]) -> None:
        """Write the run's metadata; call it at the start, and again with the result at the end."""
        for output in self._outputs:
            output.call("describe", metadata)

    def attach(self, attachment: Attachment) -> None:
        """Write a file of the run along with it."""
        for output in self._outputs:
            output.call("attach", attachment)

    def flush(self) -> None:
        """Bring everything recorded so far into the files."""
        for output in self._outputs:
            output.call("flush")

    def flush_when_due(self) -> None:
        """Flush twice a second of real time, so that a run that waits and is killed can be read."""
        now = time.monotonic()
        if now >= self._flush_due:
            self._flush_due = now + _FLUSH_SECONDS
            self.flush()

    def enable(self, enabled: bool, kind: type[RunWriter] = RunWriter) -> None:
        """Continue, or pause: events of a pause are not recorded, and the files are whole.

        :param kind: only the writers of this class.
        """
        for output in self._outputs:
            if isinstance(output.writer, kind):
                output.enable(enabled)

    def close(self) -> None:
        """Stop listening and finish the files; a second call does nothing."""
        for output in self._outputs:
            self._bus.unsubscribe(output.take)
            output.call("close")
        self._outputs = []


class _Output:
    """One writer, cut off from the run when it fails."""

    def __init__(self, recorder: Recorder, writer: RunWriter) -> None:
        self.writer = writer
        self._recorder = recorder
        self._failed = False
        self._enabled = True
        self._lock = threading.RLock()

    def take(self, event: Event) -> None:
        """Write an event."""
        with self._lock:
            if self._enabled and not self._failed:
                try:
                    self.writer.write(event)
                except TraceError as error:
                    self._fail(error)

    def enable(self, enabled: bool) -> None:
        """Write events, or pass them over."""
        with self._lock:
            self._enabled = enabled
            if not enabled:
                self.call("settle")

    def call(self, method: str, *args: object) -> None:
        """Call a method of the writer."""
        with self._lock:
            if not self._failed or method == "close":
                try:
                    getattr(self.writer, method)(*args)
                except TraceError as error:
                    self._fail(error)

    def _fail(self, error: TraceError) -> None:
        if not self._failed:
            self._failed = True
            self._recorder.errors.append(error)
            _log.error("recording stopped: %s", error)
