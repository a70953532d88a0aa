"""Recording of a blackboard's interfaces in a separate process."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cxbridge.blackboard.patterns import Pattern
from cxbridge.daemon.services.options import RecordOptions
from cxbridge.daemon.services.service import ReadyCallback, Service, do_nothing, format_write_counts
from cxbridge.events import Sink
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.printing import format_count
from cxbridge.resources import VERSION
from cxbridge.run.recording import open_writers
from cxbridge.trace.formats.base import RecordingInfo
from cxbridge.trace.forwarding import COMPONENT, WriteForwarder
from cxbridge.trace.recorder import Recorder

_PROGRESS_INTERVAL_S = 0.5  # seconds between progress reports
_SCENARIO = "record"  # the name of the recording in bblogger files


@dataclass(slots=True)
class RecordReport:
    """The result of a recording.

    :param seconds: the duration in real time.
    :param write_counts: the number of recorded writes by ``Type::id``.
    :param skipped_count: the number of writes that the blackboard has replaced by later writes.
    :param gaps: the start in microseconds since the epoch, and the duration in seconds, of each loss of the
        connection.
    :param errors: the reasons why the recording into a file stopped early.
    """

    url: str
    outputs: tuple[str, ...]
    seconds: float = 0.0
    write_counts: dict[str, int] = field(default_factory=dict)
    skipped_count: int = 0
    gaps: list[tuple[int, float]] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    def to_json(self) -> dict[str, Any]:
        """Return the result for JSON."""
        return {
            "url": self.url,
            "outputs": list(self.outputs),
            "seconds": round(self.seconds, 3),
            "writes": sum(self.write_counts.values()),
            "interfaces": dict(sorted(self.write_counts.items())),
            "skipped": self.skipped_count,
            "gaps": [{"start_us": start_us, "seconds": round(seconds, 3)} for start_us, seconds in self.gaps],
            "errors": self.errors,
        }

    @property
    def counts_text(self) -> str:
        """The numbers of writes and interfaces, with nouns."""
        return format_write_counts(self.write_counts)

    def to_lines(self) -> list[str]:
        """Return the result as lines of text."""
        lines = [f"{self.counts_text} in {self.seconds:.1f} s"]
        lines += [f"  {uid}  {count}" for uid, count in sorted(self.write_counts.items())]
        if self.skipped_count:
            lines.append(
                f"left out, because newer writes replaced them: {format_count(self.skipped_count, 'write')}"
            )
        if self.gaps:
            seconds = sum(seconds for _, seconds in self.gaps)
            lines.append(
                f"{format_count(len(self.gaps), 'gap')} without a connection, {seconds:.1f} s in total"
            )
        return lines


def record(
    options: RecordOptions,
    *,
    console: Sink | None = None,
    on_ready: ReadyCallback = do_nothing,
    on_progress: Callable[[RecordReport], None] = do_nothing,
) -> RecordReport:
    """Record for the duration, or until a signal (SIGINT, SIGTERM or SIGHUP) or the failure of all files.

    :param console: gets the log lines.
    :param on_ready: called with a stop function when all interfaces are open.
    :param on_progress: called with the present result about twice a second.
    :raises CxbridgeError: if a pattern is invalid, no server answers at the URL, or a file cannot be created.
    """
    patterns = list(map(Pattern.parse, options.patterns))
    report = RecordReport(options.url, tuple(str(path) for path in options.outputs))
    with Service(console, on_ready) as service:
        # a separate bus: the blackboard emits its own events on the bus of the service
        recorded_bus = service.make_bus()
        registry = InterfaceRegistry(options.interface_dirs)
        board = service.open_blackboard(options.url, registry)
        recording_info = RecordingInfo(registry, _SCENARIO, service.clock.now_us())
        formats_and_paths = [
            ("mcap" if path.suffix == ".mcap" else "bblogger", path) for path in options.outputs
        ]
        recorder = service.enter_context(
            Recorder(recorded_bus, open_writers(formats_and_paths, recording_info))
        )
        recorder.describe({"cxbridge": VERSION, "clock": service.clock.name, "blackboard": options.url})
        forwarder = WriteForwarder(board, patterns, recorded_bus)
        service.callback(forwarder.close)
        service.set_wake_function(forwarder.wake)
        start_s = time.monotonic()
        interface_count = forwarder.start()
        recorded_bus.logger(COMPONENT).info(
            f"Ready: {interface_count} interfaces at {options.url} match"
            if interface_count
            else "Ready: nothing matches yet"
        )
        service.report_ready(f"recording {options.url}")

        def update_report() -> float:
            """Update the report; return the seconds until the end, or else until the next update."""
            seconds = report.seconds = time.monotonic() - start_s
            report.write_counts, report.skipped_count = dict(forwarder.write_counts), board.skipped
            report.gaps = [(gap.start_us, gap.seconds) for gap in forwarder.gaps]
            report.errors = [str(error) for error in recorder.errors]
            on_progress(report)
            return _PROGRESS_INTERVAL_S if options.duration_s is None else options.duration_s - seconds

        # the recording ends when all of its files have failed
        while (
            not service.stopped.is_set()
            and (remaining_s := update_report()) > 0
            and len(report.errors) < len(options.outputs)
        ):
            forwarder.poll(min(remaining_s, _PROGRESS_INTERVAL_S))
            recorder.flush_when_due()
        forwarder.close()
        recorder.describe({"skipped": str(board.skipped), "gaps": str(len(forwarder.gaps))})
        recorder.close()
        update_report()
    return report


def find_duplicate_output(outputs: Sequence[Path]) -> Path | None:
    """Return the absolute path of an output that is named twice, or None."""
    paths = [path.absolute() for path in outputs]
    return next((path for path in paths if paths.count(path) > 1), None)
