"""The event bus."""

from __future__ import annotations

import sys
import threading

from cxbridge.clock import VirtualClock
from cxbridge.events import Event, EventBus, Level, LogLine, RuleFired


def test_sinks_get_their_kinds_in_order():
    bus = EventBus(VirtualClock(1))
    rules: list[Event] = []
    everything: list[Event] = []
    bus.subscribe(rules.append, RuleFired)
    bus.subscribe(everything.append, RuleFired, LogLine)
    fired = RuleFired(1, "executive", 1, "r", "f-1")
    bus.emit(fired)
    bus.logger("C").warn("w")
    assert rules == [fired]
    assert everything == [fired, LogLine(1, Level.WARN, "C", "w")]


def test_bus_without_sinks_wants_no_events():
    bus = EventBus(VirtualClock())
    assert not bus.wants(LogLine)
    got: list[Event] = []
    bus.subscribe(got.append, LogLine)
    assert bus.wants(LogLine)
    assert not bus.wants(RuleFired)
    bus.unsubscribe(got.append)
    assert not bus.wants(LogLine)
    bus.logger("C").error("lost")
    assert got == []


def test_concurrent_subscription_is_not_lost():
    bus = EventBus(VirtualClock())
    unheard: list[type[Event]] = []

    def come_and_go(kind: type[Event]) -> None:
        for _ in range(30_000):
            got: list[Event] = []
            bus.subscribe(got.append, kind)
            if not bus.wants(kind):
                unheard.append(kind)
            bus.unsubscribe(got.append)

    threads = [threading.Thread(target=come_and_go, args=(kind,)) for kind in (LogLine, RuleFired)]
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
    finally:
        sys.setswitchinterval(interval)
    assert unheard == []
    assert not bus.wants(LogLine)
    assert not bus.wants(RuleFired)
