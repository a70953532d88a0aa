"""How skills ended in recorded runs, for the simulator to draw from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.events import Event, FactChange, InterfaceWrite, SkillStatus
from cxbridge.skiller.simulation.recorded import Sample
from cxbridge.skiller.status import Status
from cxbridge.trace.facts import FactSyntaxError, parse_fact
from cxbridge.trace.formats.registry import open_run

_TYPE = "SkillerInterface"
_ENDS = {"S_FINAL": Status.S_FINAL, "S_FAILED": Status.S_FAILED}


def read_samples(path: Path) -> list[Sample]:
    """Return the skills that came to an end in a recorded run, of ours or of Fawkes; any format.

    Skills that were stopped or replaced are left out. What the Skiller wrote to the blackboard counts; else
    what the executive saw of it, as in text logs, which is up to a loop later.

    :raises TraceError: when the run cannot be read, or knows no times.
    """
    run = open_run(path)
    if run.format == "transitions":
        raise TraceError(
            "this format knows no times, so not how long skills took", file=path, hint="name the recorded run"
        )
    by_source: dict[type[Event], list[_Seen]] = {}
    for event in run:
        seen = _look(event)
        if seen is not None:
            by_source.setdefault(type(event), []).append(seen)
    for source in (InterfaceWrite, FactChange, SkillStatus):
        if source in by_source:
            return list(_samples(by_source[source]))
    return []


@dataclass(frozen=True, slots=True)
class _Seen:
    """What a Skiller showed at some time."""

    time_us: int
    skiller: str
    skill_string: str
    msgid: int
    status: str
    error: str


def _look(event: Event) -> _Seen | None:
    if isinstance(event, InterfaceWrite):
        kind, _, skiller = event.uid.partition("::")
        if kind != _TYPE:
            return None
        values = event.values
        status = getattr(values["status"], "name", str(values["status"]))
        return _Seen(
            event.time_us, skiller, values["skill_string"], int(values["msgid"]), status, values["error"]
        )
    if isinstance(event, SkillStatus):
        return _Seen(event.time_us, event.skiller, event.skill_string, event.msgid, event.status, "")
    if isinstance(event, FactChange) and event.asserted and event.template == _TYPE:
        try:
            _, slots = parse_fact(event.text)
            return _Seen(
                event.time_us,
                _text(slots["id"]),
                _text(slots["skill_string"]),
                int(slots["msgid"]),
                slots["status"],
                _text(slots["error"]),
            )
        except (FactSyntaxError, KeyError, ValueError):
            return None
    return None


def _text(printed: str) -> str:
    """Return a string as it was before CLIPS printed it."""
    return printed[1:-1] if len(printed) > 1 and printed[0] == printed[-1] == '"' else printed


def _samples(seen: list[_Seen]) -> Iterator[Sample]:
    running: dict[str, _Seen] = {}
    for now in seen:
        begun = running.get(now.skiller)
        same = begun is not None and (begun.msgid, begun.skill_string) == (now.msgid, now.skill_string)
        if now.status == "S_RUNNING":
            if not same:
                running[now.skiller] = now
            continue
        running.pop(now.skiller, None)
        if begun is not None and same and now.status in _ENDS:
            seconds = max(0, now.time_us - begun.time_us) / MICROSECONDS  # a clock may have been set
            yield Sample(now.skill_string, seconds, _ENDS[now.status], now.error)
