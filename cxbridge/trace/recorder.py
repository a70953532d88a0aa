"""Writes the events of a run to files."""

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

_FLUSH_INTERVAL_S = 0.5  # in real time: a killed run loses little


class Recorder(Closing):
    """Writes the events of a bus to any number of files until it is closed.

    A writer that fails, for example on a full disk, gets no more events, and the run continues; `errors` has
    the reason. Several threads may emit events; a writer gets one event at a time.

    :param writers: the writers of the files, closed by the recorder.
    :param level: the level of recorded events; the writer of text logs stores facts and firings at every
        level.
    """

    def __init__(
        self, bus: EventBus, writers: Sequence[RunWriter], level: RecordLevel = RecordLevel.TRANSITIONS
    ) -> None:
        self.errors: list[TraceError] = []
        self._bus = bus
        self._next_flush_s = 0.0
        self._outputs = [_Output(self, writer) for writer in writers]
        for output in self._outputs:
            # one subscription per writer, so that the producers of events that no writer stores do nothing
            bus.subscribe(output.write_event, *output.writer.event_types(level))

    def describe(self, metadata: Mapping[str, str]) -> None:
        """Write the run's metadata; called at the start, and with the result at the end."""
        for output in self._outputs:
            output.call_writer("describe", metadata)

    def attach(self, attachment: Attachment) -> None:
        """Write a file of the run."""
        for output in self._outputs:
            output.call_writer("attach", attachment)

    def flush(self) -> None:
        """Write everything recorded so far to the files."""
        for output in self._outputs:
            output.call_writer("flush")

    def flush_when_due(self) -> None:
        """Flush, unless this method has flushed less than half a second of real time ago.

        Called often, this method keeps the files of a killed run readable, and nearly complete.
        """
        now_s = time.monotonic()
        if now_s >= self._next_flush_s:
            self._next_flush_s = now_s + _FLUSH_INTERVAL_S
            self.flush()

    def close(self) -> None:
        """Stop listening and complete the files; further calls do nothing."""
        for output in self._outputs:
            self._bus.unsubscribe(output.write_event)
            output.call_writer("close")
        self._outputs = []


class _Output:
    """A writer that gets no more events after an error."""

    def __init__(self, recorder: Recorder, writer: RunWriter) -> None:
        self.writer = writer
        self._recorder = recorder
        self._has_failed = False
        self._lock = threading.RLock()  # an event that the writer itself causes must not block its thread

    def write_event(self, event: Event) -> None:
        """Write an event, unless the writer has failed."""
        self.call_writer("write", event)

    def call_writer(self, method_name: str, *args: object) -> None:
        """Call a method of the writer, unless the writer has failed; a failed writer can only be closed."""
        with self._lock:
            # a failed writer still has an open file
            if self._has_failed and method_name != "close":
                return
            try:
                getattr(self.writer, method_name)(*args)
            except TraceError as error:
                # a failed writer may fail once more while it is closed: only the first error is reported
                if not self._has_failed:
                    self._has_failed = True
                    self._recorder.errors.append(error)
                    # not a line on the bus, which would pass it to all writers while this one is locked
                    _log.error("recording stopped: %s", error)
