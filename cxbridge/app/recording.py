"""The recorders that a run's options ask for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge import __version__
from cxbridge.app.assembly import Assembly
from cxbridge.app.options import RunOptions
from cxbridge.trace.levels import RecordLevel
from cxbridge.trace.recorder import Recorder

if TYPE_CHECKING:
    from cxbridge.trace.formats.base import RunWriter


def start_recording(assembly: Assembly, options: RunOptions) -> Recorder:
    """Open the files that the options name and record into them from now on.

    :raises TraceError: when a file cannot be written.
    """
    writers: list[RunWriter] = []
    if options.trace is not None:
        from cxbridge.trace.formats.mcap_writer import McapWriter  # noqa: PLC0415  slow to import

        writers.append(McapWriter(options.trace))
    if options.log is not None:
        from cxbridge.trace.formats.fawkes_log_writer import FawkesLogWriter  # noqa: PLC0415

        writers.append(FawkesLogWriter(options.log))
    recorder = Recorder(assembly.bus, writers, RecordLevel(options.trace_level))
    recorder.describe(
        {
            "cxbridge": __version__,
            "spec": assembly.spec,
            "clock": assembly.clock.name,
            "scenario": str(assembly.places.config_file),
        }
    )
    return recorder
