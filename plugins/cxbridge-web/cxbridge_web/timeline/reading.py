"""Reads a run in one pass into the data of its timeline: history, rules, facts, log and interfaces.

A recording may have millions of events. The timeline keeps the first and the last events of each kind, up to
a limit, and a note states the number of omitted events.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

from cxbridge.events import Event, FactChange, InterfaceMessage, InterfaceWrite, Level, LogLine, RuleFired
from cxbridge.history.builder import HistoryLimits, RunHistory
from cxbridge.history.truncation import truncate
from cxbridge.trace.codec import values_with_enum_names
from cxbridge.trace.formats.base import Run
from cxbridge_web.timeline.events import Moment
from cxbridge_web.timeline.truncation import TruncatedList

MAX_VALUE_LENGTH: Final = 400  # characters of the value of a field

BIN_US: Final = 100_000  # width in microseconds of the bins in which firings and facts are counted


@dataclass(frozen=True, slots=True)
class TimelineLimits(HistoryLimits):
    """The limits of the numbers of events in a timeline. Trace viewers handle more events than the web page.

    :param log: the limit of log lines of each level.
    :param writes: the limit of writes that changed an interface, and of messages.
    """

    goals: int = 100_000
    actions: int = 300_000
    calls: int = 100_000
    transitions: int = 3_000_000
    log: int = 500_000
    writes: int = 500_000
    firings: int = 500_000


@dataclass(slots=True)
class TimelineData:
    """The data of a timeline.

    :param firings: the moment, the environment and the rule of each firing.
    :param log: the moment, the component and the text of each log line, by level.
    :param changes: the moment, the interface and the changed fields as texts of each change.
    :param messages: the moment, the interface and the text of each message.
    :param interfaces: the last values of each interface, in the order of first appearance.
    :param facts: the last moment of each bin, and the change of the number of facts since the start.
    :param notes: warnings for the reader, in whole sentences.
    """

    history: RunHistory
    firings: TruncatedList[tuple[Moment, str, str]]
    log: dict[Level, TruncatedList[tuple[Moment, str, str]]]
    changes: TruncatedList[tuple[Moment, str, dict[str, str]]]
    messages: TruncatedList[tuple[Moment, str, str]]
    interfaces: dict[str, dict[str, str]] = field(default_factory=dict)
    facts: dict[int, tuple[Moment, int]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def read_timeline(run: Run, limits: TimelineLimits | None = None) -> TimelineData:
    """Read a run and return the data of its timeline."""
    limits = limits or TimelineLimits()
    data = TimelineData(
        RunHistory(limits, run.start_us),
        TruncatedList(limits.firings),
        {level: TruncatedList(limits.log) for level in Level},
        TruncatedList(limits.writes),
        TruncatedList(limits.writes),
    )
    fact_count = 0
    for event in run:
        seq = data.history.event_count
        data.history.record_event(event)
        moment = seq, data.history.end
        if isinstance(event, FactChange):
            fact_count += 1 if event.asserted else -1
            data.facts[moment[1] // BIN_US] = moment, fact_count
        else:
            _add_event(data, event, moment)
    lists_by_noun: dict[str, TruncatedList[Any]] = {
        f"log lines of level {level.value}": lines for level, lines in data.log.items()
    }
    lists_by_noun |= {"interface writes": data.changes, "messages": data.messages, "firings": data.firings}
    data.notes = [
        *run.notes,
        *data.history.clock.describe_setbacks(),
        *(_make_note(noun, events) for noun, events in lists_by_noun.items() if events.lost),
        *data.history.omission_notes(),
    ]
    return data


def _add_event(data: TimelineData, event: Event, moment: Moment) -> None:
    """Add an event other than a change of a fact."""
    match event:
        case RuleFired():
            data.firings.add((moment, event.env, event.rule))
        case LogLine():
            data.log[event.level].add((moment, event.component, truncate(event.text)))
        case InterfaceWrite():
            values = data.interfaces.setdefault(event.uid, {})
            field_texts = {
                name: _format_value(value) for name, value in values_with_enum_names(event.values).items()
            }
            field_texts = {name: truncate(text, MAX_VALUE_LENGTH) for name, text in field_texts.items()}
            changed_fields = {name: text for name, text in field_texts.items() if values.get(name) != text}
            values.update(changed_fields)
            if changed_fields:  # a program may write the same values in each loop
                data.changes.add((moment, event.uid, changed_fields))
        case InterfaceMessage():
            data.interfaces.setdefault(event.uid, {})
            fields = values_with_enum_names(event.values).items()
            values_text = " ".join(f"{name}={_format_value(value)}" for name, value in fields)
            sender = f" from {event.sender}" if event.sender else ""
            text = f"{event.message} {event.msgid} {event.outcome}{sender}: {values_text}"
            data.messages.add((moment, event.uid, truncate(text)))


def _make_note(noun: str, events: TruncatedList[Any]) -> str:
    """Return the warning about omitted events."""
    return (
        f"{events.lost} of {events.total} {noun} are omitted from the middle of the run: "
        "'cxbridge trace cat' shows them."
    )


def _format_value(value: object) -> str:
    """Return a field's value as text."""
    match value:
        case bool():
            return "true" if value else "false"
        case float():
            return f"{value:.6g}"
        case list() | tuple():
            return f"[{', '.join(map(_format_value, value))}]"
        case bytes():
            return value.hex()
    return str(value)
