"""A new kind of event: the class alone adds the kind to files, selections and streams."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.errors import TraceError
from cxbridge.event_kinds import EVENT_TYPES, EventDescription, RecordLevel, parse_pattern_fields
from cxbridge.events import Event, EventBus
from cxbridge.trace.compare.selection import Selection
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.listing import event_filter, json_lines, text_lines
from cxbridge.trace.recorder import Recorder
from cxbridge.trace.summary import summarise
from tests.support import needs_plugin

BEFORE = dict(EVENT_TYPES)


class BatteryCharge(Event, frozen=True):
    """A battery has another charge."""

    KIND = EventDescription(
        "battery",
        "/battery/",
        "robot",
        level=RecordLevel.RULES,
        pattern_fields=parse_pattern_fields("robot charge"),
        subject_fields=("robot",),
    )

    robot: str
    charge: float
    cells: int = 0


del EVENT_TYPES["battery"]  # only the tests of this file have the kind

EVENTS: list[Event] = [
    BatteryCharge(1_000_000, "r1", 0.75, 6),
    BatteryCharge(2_000_000, "r2", 1e-05),
    BatteryCharge(3_000_000, "r1", 0.5),
]


@pytest.fixture
def events() -> Iterator[list[Event]]:
    EVENT_TYPES["battery"] = BatteryCharge
    yield EVENTS
    del EVENT_TYPES["battery"]


def recorded(path: Path, events: list[Event], level: RecordLevel) -> Path:
    bus = EventBus(VirtualClock(1))
    with Recorder(bus, [McapWriter(path)], level):
        for event in events:
            if bus.wants(BatteryCharge):
                bus.emit(event)
    return path


def test_new_kind_is_recorded_and_read_back(tmp_path: Path, events: list[Event]) -> None:
    run = open_run(recorded(tmp_path / "run.mcap", events, RecordLevel.RULES))
    assert list(run) == events
    assert list(run.select(BatteryCharge)) == events
    assert summarise(run).events == {"battery": 3}


def test_new_kind_is_listed(tmp_path: Path, events: list[Event]) -> None:
    run = open_run(recorded(tmp_path / "run.mcap", events, RecordLevel.FACTS))
    (line,) = text_lines(run, event_filter(["battery"], "0.75"))
    assert line.split()[:2] == ["0.000000", "battery"]
    (line,) = json_lines(run, event_filter(["battery"], "0.75"))
    assert line == '{"kind":"battery","time_us":1000000,"robot":"r1","charge":0.75,"cells":6}'


def test_patterns_select_new_kind(events: list[Event]) -> None:
    only, ignore = (
        Selection(only=["battery:r1"]).content_selector(),
        Selection(ignore=["battery.charge"]).content_selector(),
    )
    assert [event for event in events if only(event)] == [events[0], events[2]]
    same = BatteryCharge(4_000_000, "r1", 0.25)
    assert [ignore(event) for event in (*events, same)] == [
        BatteryCharge(1_000_000, "r1", 0.0, 6),
        BatteryCharge(2_000_000, "r2", 0.0),
        BatteryCharge(3_000_000, "r1", 0.0),
        None,
    ]
    with pytest.raises(TraceError, match="unknown field 'volts'"):
        Selection(only=["battery:volts=1"])


@needs_plugin("web")
def test_web_client_follows_new_kind(events: list[Event]) -> None:
    from web_tests.support import read_events, serving

    with serving() as (daemon, client, _):
        with client.open("GET", "/api/cxbridge/events?kinds=battery") as stream:
            following = read_events(stream)
            assert next(following)[1] == "hello"
            for event in events:
                daemon.bus.emit(event)
            found = [next(following)[2] for _ in events]
        assert client.get("/api/cxbridge/events?kinds=batteries").status == 400
    assert found[0] == {"kind": "battery", "time_us": 1_000_000, "robot": "r1", "charge": 0.75, "cells": 6}
    assert [event["charge"] for event in found] == [0.75, 1e-05, 0.5]


def test_new_kind_is_unregistered() -> None:
    assert EVENT_TYPES == BEFORE
    with pytest.raises(TraceError, match="unknown kind of event: 'battery'"):
        event_filter(["battery"], "")
