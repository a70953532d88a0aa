"""Records the interfaces of any blackboard, as a process of its own."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge import __version__
from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.patterns import Pattern
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import RealClock
from cxbridge.errors import BlackBoardError, TraceError
from cxbridge.events import EventBus, LogLine, Sink, SourceRead
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.process.interrupt import Interrupt
from cxbridge.run.recording import with_folder
from cxbridge.trace.forwarding import COMPONENT, WriteForwarder
from cxbridge.trace.recorder import Recorder
from cxbridge.trace.sourcing import interface_source
from cxbridge.trace.switch import RecordingSwitch

if TYPE_CHECKING:
    from cxbridge.trace.formats.base import RunWriter

_TICK_S = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordOptions:
    """The options of ``cxbridge trace record``; see its help.

    :param outputs: files that end with ``.mcap``, and folders for bblogger files.
    :param duration_s: seconds after which to end; None: when it is interrupted.
    :param switch: serve ``SwitchInterface::BBLogger``; None: unless the URL is a Fawkes'.
    """

    url: str
    patterns: tuple[str, ...]
    outputs: tuple[Path, ...]
    scenario: str = "record"
    duration_s: float | None = None
    switch: bool | None = None
    interface_dirs: tuple[Path, ...] = ()

    @property
    def wants_switch(self) -> bool:
        """Whether to serve the switch. A bblogger that is loaded later could not, so not on a Fawkes."""
        return not self.url.startswith("fawkes:") if self.switch is None else self.switch


@dataclass(slots=True)
class RecordReport:
    """What was recorded.

    :param seconds: how long, in real time.
    :param writes: entries, by ``Type::id``.
    :param skipped: updates that were left out on their way, as newer ones were there already.
    :param gaps: start (microseconds since the epoch) and seconds of each loss of the connection.
    :param errors: what could not be written.
    """

    url: str
    outputs: tuple[str, ...]
    seconds: float = 0.0
    writes: dict[str, int] = field(default_factory=dict)
    skipped: int = 0
    gaps: list[tuple[int, float]] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    def plain(self) -> dict[str, Any]:
        """Return it as JSON can have it."""
        return {
            "url": self.url,
            "outputs": list(self.outputs),
            "seconds": round(self.seconds, 3),
            "writes": sum(self.writes.values()),
            "interfaces": dict(sorted(self.writes.items())),
            "skipped": self.skipped,
            "gaps": [{"start_us": start_us, "seconds": round(seconds, 3)} for start_us, seconds in self.gaps],
            "errors": self.errors,
        }

    def lines(self) -> list[str]:
        """Return it for people."""
        count, interfaces = sum(self.writes.values()), len(self.writes)
        lines = [f"{count} writes of {interfaces} interfaces in {self.seconds:.1f} s"]
        lines += [f"  {uid}  {writes}" for uid, writes in sorted(self.writes.items())]
        if self.skipped:
            lines.append(f"{self.skipped} more writes came too fast and were left out")
        if self.gaps:
            seconds = sum(seconds for _, seconds in self.gaps)
            lines.append(f"{len(self.gaps)} gaps without a connection, {seconds:.1f} s together")
        return lines


def record(
    options: RecordOptions,
    *,
    console: Sink | None = None,
    on_ready: Callable[[Callable[[], None]], None] = lambda _stop: None,
    on_progress: Callable[[RecordReport], None] = lambda _report: None,
) -> RecordReport:
    """Record until the duration is over, or SIGINT or SIGTERM.

    :param console: gets the log lines.
    :param on_ready: called when everything is open, with what stops it.
    :param on_progress: called for what there is so far, about twice a second.
    :raises CxbridgeError: when a pattern makes no sense, nobody is at the URL, or no file can be made.
    """
    patterns = [Pattern.parse(text) for text in options.patterns]
    clock = RealClock()
    bus, out = EventBus(clock), EventBus(clock)
    if console is not None:
        bus.subscribe(console, LogLine)
        out.subscribe(console, LogLine)
    report = RecordReport(options.url, tuple(str(path) for path in options.outputs))
    stop = threading.Event()
    with Interrupt(service=True) as interrupt, ExitStack() as stack:
        board = stack.enter_context(
            open_blackboard(options.url, InterfaceRegistry(options.interface_dirs), clock, bus)
        )
        definition = partial(interface_source, InterfaceRegistry(options.interface_dirs))
        recorder = stack.enter_context(Recorder(out, _writers(options, clock.now_us(), definition)))
        recorder.describe({"cxbridge": __version__, "clock": clock.name, "blackboard": options.url})
        forwarder = WriteForwarder(board, patterns, out)
        stack.callback(forwarder.close)

        def end() -> None:
            stop.set()
            forwarder.wake()

        interrupt.on_signal(end)
        began_s = time.monotonic()
        found = forwarder.start()
        _serve_switch(options, board, forwarder, recorder, out, stack)
        out.logger(COMPONENT).info(
            f"Ready: {found} interfaces at {options.url} match" if found else "Ready: nothing matches yet"
        )
        on_ready(end)

        def look() -> float:
            seconds = report.seconds = time.monotonic() - began_s
            report.writes, report.skipped = dict(forwarder.counts), board.skipped
            report.gaps = [(gap.start_us, gap.seconds) for gap in forwarder.gaps]
            report.errors = [str(error) for error in recorder.errors]
            return _TICK_S if options.duration_s is None else options.duration_s - seconds

        while not stop.is_set() and (rest_s := look()) > 0 and len(report.errors) < len(options.outputs):
            forwarder.poll(min(rest_s, _TICK_S))
            recorder.flush_when_due()
            on_progress(report)
        forwarder.close()
        recorder.describe({"skipped": str(board.skipped), "gaps": str(len(forwarder.gaps))})
        recorder.close()
        look()
    return report


def _writers(
    options: RecordOptions, start_us: int, definition: Callable[[str, int], SourceRead | None]
) -> list[RunWriter]:
    """Open the outputs.

    :param definition: returns the definition of an interface type.
    :raises TraceError: when one cannot be written.
    """
    writers: list[RunWriter] = []
    try:
        for path in options.outputs:
            if path.suffix == ".mcap":
                from cxbridge.trace.formats.mcap.writer import McapWriter  # noqa: PLC0415 - slow to import

                writers.append(McapWriter(with_folder(path), definition=definition))
            else:
                from cxbridge.trace.formats.bblogger.writer import BBLoggerWriter  # noqa: PLC0415

                writers.append(BBLoggerWriter(path, options.scenario, start_us=start_us))
    except TraceError:
        for writer in writers:
            writer.close()
        raise
    return writers


def _serve_switch(
    options: RecordOptions,
    board: BlackBoard,
    forwarder: WriteForwarder,
    recorder: Recorder,
    out: EventBus,
    stack: ExitStack,
) -> None:
    """Let ``ffbblog enable`` and ``disable`` switch the recording, if nobody else has that switch."""
    if not options.wants_switch:
        return

    def switch(enabled: bool) -> None:
        forwarder.enabled = enabled
        recorder.enable(enabled)

    log = out.logger(COMPONENT)
    try:
        stack.callback(RecordingSwitch(board, switch, log).close)
    except BlackBoardError as error:
        log.warn(f"This recording has no switch: {error.message}")


def same_output(outputs: Sequence[Path]) -> Path | None:
    """Return an output that is named twice."""
    seen = [path.absolute() for path in outputs]
    return next((path for path in seen if seen.count(path) > 1), None)
