"""Reads how skills ended in recorded runs, for the simulator to draw from."""

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

_TYPE = "SkillerInterface"
_ENDS = {"S_FINAL": Status.S_FINAL, "S_FAILED": Status.S_FAILED}
_ENV = ""  # several environments see one and the same Skiller


def read_samples(path: Path) -> list[Sample]:
    """Return the skills that came to an end in a recorded run, of ours or of Fawkes; any format.

    Skills that were stopped or replaced are left out. The Skiller's writes on the blackboard count; else
    the executive's events, as in text logs, up to a loop later.

    :raises TraceError: when the run cannot be read, or knows no times.
    """
    run = open_run(path)
    if run.format == "transitions":
        raise TraceError(
            "this format knows no times, so not how long skills took", file=path, hint="name the recorded run"
        )
    sources: tuple[type[Event], ...] = InterfaceWrite, FactChange, SkillStatus
    histories = {source: RunHistory(UNLIMITED) for source in sources}
    for event in run:
        if isinstance(event, InterfaceWrite):
            histories[InterfaceWrite].take(event)
            continue
        status = _status(event)
        if status is not None:
            history = histories[type(event)]
            if isinstance(event, FactChange):
                history.take(event)  # which has the reason of a failure
            history.take(status)
    first = next((history for history in histories.values() if history.calls), RunHistory())
    return [
        Sample(
            call.skill_string, (call.end[1] - call.begin[1]) / MICROSECONDS, _ENDS[call.status], call.error
        )
        for call in first.calls
        if call.end is not None and call.end != call.begin and call.status in _ENDS
    ]


def _status(event: Event) -> Transition | None:
    """Return the status of a Skiller in an event; None when it has none."""
    if isinstance(event, SkillStatus):
        return replace(event, env=_ENV)
    if isinstance(event, FactChange) and event.asserted and event.template == _TYPE:
        try:
            return TransitionTracker(_ENV).fact(event.time_us, *parse_fact(event.text))
        except FactSyntaxError:
            return None
    return None
