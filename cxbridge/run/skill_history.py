"""Durations and outcomes of skills in recorded runs, as samples for the simulator."""

from __future__ import annotations

from pathlib import Path

from msgspec.structs import replace

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.events import InterfaceWrite, SkillStatus
from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.skiller.simulation.recorded import Sample
from cxbridge.skiller.status import Status
from cxbridge.trace.formats.registry import open_run

_END_STATUSES = {"S_FINAL": Status.S_FINAL, "S_FAILED": Status.S_FAILED}
_ENV = ""  # all environments of a run see the same Skiller


def read_samples(path: Path) -> list[Sample]:
    """Return the finished skills of a recorded run of any format.

    Stopped and replaced skills are left out. Times come from the Skiller's writes. Text logs have only the
    executive's events, which are up to one loop later.

    :raises TraceError: if the run cannot be read or has no times.
    """
    run = open_run(path)
    if run.format == "transitions":
        raise TraceError(
            "this format has no times, so the durations of skills are unknown",
            file=path,
            hint="name the recorded run",
        )
    write_history, status_history = RunHistory(UNLIMITED), RunHistory(UNLIMITED)
    for event in run:
        if isinstance(event, InterfaceWrite):
            write_history.record_event(event)
        elif isinstance(event, SkillStatus):
            status_history.record_event(replace(event, env=_ENV))
    # a skill whose start is not recorded has the same moment as begin and end, and so no duration
    return [
        Sample(
            call.skill_string,
            (call.end.time - call.begin.time) / MICROSECONDS,
            _END_STATUSES[call.status],
            call.error,
        )
        for call in write_history.calls or status_history.calls
        if call.end is not None and call.end != call.begin and call.status in _END_STATUSES
    ]
