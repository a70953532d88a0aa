"""The recording of a run or a daemon: the files of its options, and the component that writes them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from cxbridge.event_kinds import RecordLevel
from cxbridge.mainloop import Hook
from cxbridge.resources import VERSION
from cxbridge.run.components.component import Component
from cxbridge.run.options import RunOptions
from cxbridge.trace.formats.base import RecordingInfo, RunWriter
from cxbridge.trace.formats.files import rename_previous
from cxbridge.trace.formats.registry import FORMAT_MODULES
from cxbridge.trace.recorder import Recorder
from cxbridge.trace.source_records import emit_configuration

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team


DAEMON = "daemon"
"""The scenario name in bblogger files of a daemon without an executive."""


class RecorderComponent(Component):
    """Records events from construction until :meth:`close`.

    :param run: a run, a team or a daemon.
    :param writers: additional writers; :meth:`close` closes them.
    :param keep: whether to rename an existing recording and an existing log instead of overwriting them.
    :raises CxbridgeError: if a file cannot be written.
    """

    hooks = (Hook.POST_LOOP,)
    steady = True  # the recording includes the time while a daemon is paused, and continues after a reset

    def __init__(self, run: Any, writers: Sequence[RunWriter] = (), *, keep: bool = False) -> None:
        self.recorder = start_recording(run, run.options, writers, keep=keep)

    @property
    def fault(self) -> str:
        """The first error of a writer; empty without one."""
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


def start_recording(
    run: Run | Team, options: RunOptions, writers: Sequence[RunWriter] = (), *, keep: bool = False
) -> Recorder:
    """Open the files of the options and start recording.

    :param writers: additional writers; the recorder closes them.
    :param keep: whether to rename an existing recording and an existing log instead of overwriting them.
    :raises CxbridgeError: if a file cannot be written.
    """
    # the previous recording may show why a program crashed before this restart
    for file in (options.trace, options.log) if keep else ():
        if file is not None and (renamed := rename_previous(file)) is not None:
            run.bus.logger("Recorder").info(f"The previous recording is kept as {renamed}")
    recording_info = RecordingInfo(
        run.registry,
        run.spec or DAEMON,
        run.clock.now_us(),
        uses_utc=run.clock.is_virtual,
        has_files=options.trace_files,
    )
    outputs = {"mcap": options.trace, "fawkes-log": options.log, "bblogger": options.bblog}
    paths_by_format = {format_name: path for format_name, path in outputs.items() if path is not None}
    recorder = Recorder(
        run.bus,
        [*writers, *open_writers(paths_by_format.items(), recording_info)],
        RecordLevel(options.trace_level),
    )
    recorder.describe(
        {
            "cxbridge": VERSION,
            "spec": run.spec,
            "clock": run.clock.name,
            "start_us": str(run.clock.start_us),
            "scenario": str(run.paths.config_file),
        }
    )
    # the configuration is written first, although other sources were read before the recorder existed
    early_events = [] if run.early_sources is None else run.early_sources.take_events()
    if options.trace_files:
        emit_configuration(run.bus, run.config)
    for event in early_events:
        run.bus.emit(event)
    return recorder


def open_writers(
    formats_and_paths: Iterable[tuple[str, Path]], recording_info: RecordingInfo
) -> list[RunWriter]:
    """Open the files for the recording of a run. If one cannot be opened, none stays open.

    :param formats_and_paths: the name of the format and the path of each file.
    :raises CxbridgeError: if a file cannot be written, or no installed package provides a format.
    """
    writers: list[RunWriter] = []
    with ExitStack() as undo:
        for format_name, path in formats_and_paths:
            module = FORMAT_MODULES.load_target(FORMAT_MODULES.find(format_name))
            open_recording: Callable[[Path, RecordingInfo], RunWriter] = resolve_name(module.RECORDING)
            writers.append(undo.enter_context(open_recording(path, recording_info)))
        undo.pop_all()
    return writers
