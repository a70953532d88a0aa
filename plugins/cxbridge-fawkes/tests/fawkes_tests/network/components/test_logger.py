"""The log over Fawkes' protocol."""

from __future__ import annotations

from cxbridge.clock import RealClock
from cxbridge.events import EventBus, Level, LogLine
from cxbridge_fawkes.network.components.logger import NetworkLogger
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from cxbridge_fawkes.network.messages.logger import LogKind, LogMessage

SUBSCRIBE, UNSUBSCRIBE = (
    FawkesFrame(ComponentId.NETWORK_LOGGER, kind) for kind in (LogKind.SUBSCRIBE, LogKind.UNSUBSCRIBE)
)


def test_subscribers_get_lines_until_they_unsubscribe(site):
    bus = EventBus(RealClock())
    site.start(components=[NetworkLogger(bus)])
    clients = [site.raw() for _ in range(2)]
    for client in clients:
        client.send(SUBSCRIBE)
        assert isinstance(client.ask(bb.ListAll()), bb.InterfaceList)
    bus.emit(LogLine(5_000_007, Level.ERROR, "Skiller", "no\nsuch skill"))
    for client in clients:
        line = LogMessage(5_000_007, Level.ERROR, "Skiller", "no\n  such skill")
        assert client.take() == line.to_frame()
    clients[0].send(UNSUBSCRIBE)
    assert isinstance(clients[0].ask(bb.ListAll()), bb.InterfaceList)
    bus.logger("Skiller").info("again")
    assert isinstance(clients[0].ask(bb.ListAll()), bb.InterfaceList)
    assert clients[1].take().kind == LogKind.LOGMESSAGE


def test_logger_listens_to_bus_only_with_subscriber(site):
    bus = EventBus(RealClock())
    site.start(components=[NetworkLogger(bus)])
    client = site.raw()
    client.send(SUBSCRIBE)
    client.ask(bb.ListAll())
    assert bus.wants(LogLine)
    site.server.stop()
    assert not bus.wants(LogLine)
