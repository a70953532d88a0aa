"""Durations and outcomes of skills in recorded runs, as samples for the simulator."""

from __future__ import annotations

from pathlib import Path

from msgspec.structs import replace

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.events import Event, FactChange, InterfaceWrite, SkillStatus
from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.history.transitions import Transition, TransitionTracker
from cxbridge.skiller.simulation.recorded import Sample
from cxbridge.skiller.status import Status
from cxbridge.trace.formats.registry import open_run

_INTERFACE_TYPE = "SkillerInterface"
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
    event_types: tuple[type[Event], ...] = InterfaceWrite, FactChange, SkillStatus
    histories = {source: RunHistory(UNLIMITED) for source in event_types}
    for event in run:
        if isinstance(event, InterfaceWrite):
            histories[InterfaceWrite].record_event(event)
            continue
        status = _read_status(event)
        if status is not None:
            history = histories[type(event)]
            if isinstance(event, FactChange):
                history.record_event(event)  # the fact has the reason for a failure
            history.record_event(status)
    # dictionaries keep the order: writes have the most exact times, statuses the least exact ones
    history = next((history for history in histories.values() if history.calls), RunHistory())
    return [
        Sample(
            call.skill_string,
            (call.end.time - call.begin.time) / MICROSECONDS,
            _END_STATUSES[call.status],
            call.error,
        )
        for call in history.calls
        if call.end is not None and call.end != call.begin and call.status in _END_STATUSES
    ]


def _read_status(event: Event) -> Transition | None:
    """Return the status of a Skiller that an event of the executive shows; None for other events."""
    if isinstance(event, SkillStatus):
        return replace(event, env=_ENV)
    if isinstance(event, FactChange) and event.asserted and event.template == _INTERFACE_TYPE:
        try:
            return TransitionTracker(_ENV).track_assertion(event.time_us, *parse_fact(event.text))
        except FactSyntaxError:
            return None
    return None
