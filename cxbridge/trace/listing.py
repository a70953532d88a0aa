"""Output of the events of a run as lines of text or JSON."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.event_kinds import EVENT_TYPES
from cxbridge.events import (
    Event,
    FactChange,
    InterfaceMessage,
    InterfaceWrite,
    LogLine,
    PlannerCall,
    RuleFired,
)
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.printing import escape_record, format_count
from cxbridge.trace.codec import dump_json, encode_with_kind
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.transitions_text import format_transition

EventFilter: TypeAlias = Callable[[Event, str], bool]
"""Gets an event and its line of text; returns whether the event is shown."""


def event_filter(kinds: Sequence[str], pattern: str) -> EventFilter:
    """Return a filter by kind and line of text.

    :param kinds: the kinds of shown events; empty: all kinds.
    :param pattern: a regular expression to search in the line.
    :raises TraceError: if a kind or the pattern is invalid.
    """
    unknown_kinds = [kind for kind in kinds if kind not in EVENT_TYPES]
    if unknown_kinds:
        raise TraceError(
            f"unknown kind of event: '{unknown_kinds[0]}'", hint=f"use one of {', '.join(EVENT_TYPES)}"
        )
    types = tuple(EVENT_TYPES[kind] for kind in kinds or EVENT_TYPES)
    try:
        search = re.compile(pattern).search
    except re.error as error:
        raise TraceError(f"{pattern!r} is not a regular expression: {error}") from error
    return lambda event, line: isinstance(event, types) and search(line) is not None


def text_lines(run: Run, is_shown: EventFilter) -> Iterator[str]:
    """Yield a line per event: seconds since the start of the run, kind and description.

    If the start is unknown, the first event counts as the start.
    """
    start_us = run.start_us
    for event in run:
        start_us = event.time_us if start_us is None else start_us
        line = event_line(event)
        if is_shown(event, line):
            yield f"{(event.time_us - start_us) / MICROSECONDS:12.6f} {event.KIND.name:11s} {line}"


def json_lines(run: Run, is_shown: EventFilter) -> Iterator[str]:
    """Yield a JSON object per event: its kind, and its fields as in docs/formats.md."""
    for event in run:
        if is_shown(event, event_line(event)):
            yield encode_with_kind(event).decode()


def event_line(event: Event) -> str:
    """Return an event as text for people; the whole entry for a log line.

    The text is one line, unless a log entry, a fact or a reason has line feeds.
    """
    if isinstance(event, LogLine):
        return f"{event.level.value} {event.component}: {event.text}"
    return describe_event(event)


def describe_event(event: Event) -> str:
    """Return the description of an event as text; one line, unless a fact or a reason has line feeds."""
    # as in the format of transitions texts, so that both can be compared by eye
    if isinstance(event, TRANSITION_TYPES):
        return format_transition(event)
    if isinstance(event, RuleFired):
        return f"FIRE {event.number:4d} {event.rule}: {event.basis}"
    if isinstance(event, FactChange):
        return f"{'==>' if event.asserted else '<=='} f-{event.index:<5d} {event.text}"
    if isinstance(event, InterfaceWrite):
        return f"{event.uid} {dump_json(event.values)}"
    if isinstance(event, InterfaceMessage):
        return _describe_message(event)
    return _describe_planner_call(event) if isinstance(event, PlannerCall) else str(event)


def describe_details(event: Event) -> str:
    """Return the recorded details of a goal or plan-action, such as parameters; empty without details."""
    values = ((name, getattr(event, name)) for name in event.KIND.detail_fields)
    return escape_record(" ".join(f"{name}={value}" for name, value in values if value))


def _describe_message(event: InterfaceMessage) -> str:
    sender = f" from {event.sender}" if event.sender else ""
    values = dump_json(event.values)
    return f"{event.uid} <- {event.message} {event.msgid}{sender}, {event.outcome}: {values}"


def _describe_planner_call(event: PlannerCall) -> str:
    call_text = " ".join(filter(None, (event.call, f"for {event.goal}:", event.status, "by", event.planner)))
    if event.status == "started":
        return f"{call_text}: {event.problem} in domain {event.domain}"
    outcome = event.reason or format_count(event.actions, "action")
    return f"{call_text} after {event.duration_us / MICROSECONDS:.3f} s: {outcome}"
