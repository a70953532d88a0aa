"""The recording of a run or a daemon, as configured by its options."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from cxbridge.clock import Clock
from cxbridge.config import Configuration
from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import EventBus
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.resources import VERSION
from cxbridge.run.options import RunOptions
from cxbridge.run.paths import RunPaths
from cxbridge.trace.formats.files import keep_previous
from cxbridge.trace.recorder import Recorder
from cxbridge.trace.sourcing import EarlySources, emit_configuration, interface_source

if TYPE_CHECKING:
    from cxbridge.trace.formats.base import RunWriter


DAEMON = "daemon"
"""The scenario name in bblogger files of a daemon without an executive."""


class RecordingSubject(Protocol):
    """A run, a team or a daemon that is recorded.

    :ivar spec: the executive's spec; empty without an executive.
    :ivar early: the files that were read before the recording; None without recording.
    """

    bus: EventBus
    clock: Clock
    config: Configuration
    options: RunOptions
    registry: InterfaceRegistry
    spec: str
    paths: RunPaths
    early: EarlySources | None


def start_recording(
    assembly: RecordingSubject, options: RunOptions, more: Sequence[RunWriter] = (), *, keep: bool = False
) -> Recorder:
    """Open the files of the options and start recording.

    :param more: additional writers; the recorder closes them.
    :param keep: rename an existing file instead of overwriting it.
    :raises TraceError: if a file cannot be written.
    """
    if keep:
        _keep_previous(assembly.bus, [options.trace, options.log])
    writers = [*more]
    if options.trace is not None:
        from cxbridge.trace.formats.mcap.writer import McapWriter  # noqa: PLC0415 - slow to import

        definition = partial(interface_source, assembly.registry)
        writers.append(
            McapWriter(with_folder(options.trace), definition=definition, files=options.trace_files)
        )
    if options.log is not None:
        from cxbridge.trace.formats.fawkes_log import FawkesLogWriter  # noqa: PLC0415

        writers.append(FawkesLogWriter(with_folder(options.log), utc=assembly.clock.is_virtual))
    if options.bblog is not None:
        from cxbridge.trace.formats.bblogger.writer import BBLoggerWriter  # noqa: PLC0415

        clock = assembly.clock
        writers.append(
            BBLoggerWriter(
                options.bblog, assembly.spec or DAEMON, start_us=clock.now_us(), utc=clock.is_virtual
            )
        )
    recorder = Recorder(assembly.bus, writers, RecordLevel(options.trace_level))
    recorder.describe(
        {
            "cxbridge": VERSION,
            "spec": assembly.spec,
            "clock": assembly.clock.name,
            "start_us": str(assembly.clock.start_us),
            "scenario": str(assembly.paths.config_file),
        }
    )
    early = [] if assembly.early is None else assembly.early.take()
    if options.trace_files:
        emit_configuration(assembly.bus, assembly.config)
    for event in early:
        assembly.bus.emit(event)
    return recorder


def _keep_previous(bus: EventBus, files: Iterable[Path | None]) -> None:
    """Rename existing recordings."""
    # after a crash and restart, the last recording may show the cause of the crash
    for file in files:
        if file is not None and (kept := keep_previous(file)) is not None:
            bus.logger("Recorder").info(f"The recording before is kept as {kept}")


def with_folder(file: Path) -> Path:
    """Make the parent folder of a recording; return the file."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise TraceError(f"cannot make the folder for it: {error.strerror}", file=file) from error
    return file
