"""Reading of a run in one pass into the data of a page."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from cxbridge.events import (
    Event,
    FactChange,
    InterfaceMessage,
    InterfaceWrite,
    Level,
    LogLine,
    RuleFired,
)
from cxbridge.history.builder import RunHistory
from cxbridge.history.keeping import Kept, cut
from cxbridge.trace.codec import plain_values
from cxbridge.trace.formats.base import Run
from cxbridge_web.timeline.model import InterfaceCount, ReportLimits, RuleCount, RunModel

FACT_POINTS = 2000  # limit of points of the curve of facts

LONGEST_VALUE = 400  # limit of characters of a field's value


def read(run: Run, limits: ReportLimits | None = None) -> RunModel:
    """Read a run and return the data of its page."""
    model = read_events(run, limits, run.start_us)
    model.notes[:0] = run.notes
    return model


def read_events(
    events: Iterable[Event], limits: ReportLimits | None = None, start_us: int | None = None
) -> RunModel:
    """Return the data of a page from events."""
    reader = _ReportReader(limits or ReportLimits(), start_us)
    for event in events:
        reader.take(event)
    return reader.finish()


class _ReportReader:
    """Collects data from events in recorded order."""

    def __init__(self, limits: ReportLimits, start_us: int | None) -> None:
        self._log = {level.value: Kept[tuple[int, int, int, str]](limits.log) for level in Level}
        self._history = RunHistory(limits, start_us)
        self._model = RunModel(
            self._history,
            log=self._log,
            firings=Kept(limits.firings),
            changes=Kept(limits.writes),
            messages=Kept(limits.writes),
        )
        self._moment = (0, 0)
        self._rules: dict[tuple[str, str], int] = {}
        self._components: dict[str, int] = {}
        self._interfaces: dict[str, int] = {}
        self._values: dict[str, dict[str, str]] = {}
        self._more_facts = 0
        self._curve = _Curve(FACT_POINTS)
        self._takers: Mapping[type[Event], Callable[[Any], None]] = {
            RuleFired: self._rule,
            FactChange: self._fact,
            LogLine: self._line,
            InterfaceWrite: self._write,
            InterfaceMessage: self._message,
        }

    def take(self, event: Event) -> None:
        seq = self._history.events
        self._history.take(event)
        self._moment = seq, self._history.end
        taker = self._takers.get(type(event))
        if taker is not None:
            taker(event)

    def finish(self) -> RunModel:
        """Return the collected data."""
        model = self._model
        model.facts = self._curve.points()
        model.notes = [*self._history.clock.notes(), *self._left_out()]
        return model

    def _rule(self, event: RuleFired) -> None:
        key = event.env, event.rule
        number = self._rules.get(key)
        moment = self._moment
        if number is None:
            number = self._rules[key] = len(self._rules)
            self._model.rules.append(RuleCount(event.env, event.rule, 0, moment, moment))
        rule = self._model.rules[number]
        rule.count += 1
        rule.last = moment
        self._model.firings.add((*moment, number))

    def _fact(self, event: FactChange) -> None:
        self._more_facts += 1 if event.asserted else -1
        self._curve.add(*self._moment, self._more_facts)

    def _line(self, event: LogLine) -> None:
        component = self._components.setdefault(event.component, len(self._components))
        if component == len(self._model.components):
            self._model.components.append(event.component)
        self._log[event.level.value].add((*self._moment, component, cut(event.text)))

    def _write(self, event: InterfaceWrite) -> None:
        number = self._interface(event.uid)
        known = self._values.setdefault(event.uid, {})
        changed = {}
        for name, value in plain_values(event.values).items():
            text = cut(_value_text(value), LONGEST_VALUE)
            if known.get(name) != text:
                known[name] = changed[name] = text
        count = self._model.interfaces[number]
        now = self._moment[1]
        count.first = count.first if count.writes else now
        count.writes += 1
        count.last = now
        if changed:
            count.changes += 1
            self._model.changes.add((*self._moment, number, changed))

    def _message(self, event: InterfaceMessage) -> None:
        number = self._interface(event.uid)
        self._model.interfaces[number].messages += 1
        values = " ".join(f"{name}={_value_text(each)}" for name, each in plain_values(event.values).items())
        sender = f" from {event.sender}" if event.sender else ""
        text = f"{event.message} {event.msgid} {event.outcome}{sender}: {values}"
        self._model.messages.add((*self._moment, number, cut(text)))

    def _interface(self, uid: str) -> int:
        """Return the index of an interface, added if missing."""
        number = self._interfaces.setdefault(uid, len(self._interfaces))
        if number == len(self._model.interfaces):
            self._model.interfaces.append(InterfaceCount(uid))
        return number

    def _left_out(self) -> list[str]:
        """Return warnings about data beyond the limits."""
        model, notes = self._model, []
        for level, lines in self._log.items():
            if lines.lost:
                notes.append(_middle(f"log lines of level {level}", lines))
        if model.changes.lost:
            notes.append(_middle("interface writes", model.changes))
        if model.messages.lost:
            notes.append(_middle("messages", model.messages))
        if model.firings.lost:
            notes.append(_middle("firings", model.firings) + " All are counted in the table of rules.")
        return notes + self._history.left_out()


def _middle(noun: str, kept: Kept[Any]) -> str:
    """Return a warning about a missing middle part."""
    return (
        f"{kept.lost} of {kept.total} {noun} are left out, from the middle of the run: "
        "'cxbridge trace cat' has them."
    )


def _value_text(value: object) -> str:
    """Return a field's value as text."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value_text(each) for each in value) + "]"
    if isinstance(value, bytes):
        return value.hex()
    return str(value)


class _Curve:
    """A value over time, thinned to a limited number of points: the last of each interval."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._width = 1
        self._points: dict[int, tuple[int, int, int]] = {}

    def add(self, seq: int, time: int, number: int) -> None:
        """Add a point, not before the last one."""
        self._points[time // self._width] = (seq, time, number)
        while len(self._points) > self._limit:
            self._width *= 2
            self._points = {point[1] // self._width: point for point in self._points.values()}

    def points(self) -> list[tuple[int, int, int]]:
        return list(self._points.values())
