"""A gateway as a process of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path

from cxbridge.blackboard.patterns import Pattern
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import RealClock
from cxbridge.errors import CxbridgeError
from cxbridge.events import EventBus, LogLine, Sink
from cxbridge.gateway import Gateway
from cxbridge.gateway.gateway import COMPONENT
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.process.interrupt import Interrupt
from cxbridge.process.systemd import Notifier


def run_gateway(
    urls: tuple[str, str],
    patterns: Sequence[str],
    *,
    interface_dirs: Iterable[Path] = (),
    console: Sink | None = None,
    on_ready: Callable[[Callable[[], None]], None] = lambda _stop: None,
) -> None:
    """Mirror interfaces between the blackboards at two URLs until SIGINT or SIGTERM.

    :param console: gets the log lines.
    :param on_ready: called when both are connected, with what stops it.
    :raises CxbridgeError: when a side is not there, or a pattern makes no sense.
    """
    for pattern in patterns:
        Pattern.parse(pattern)
    if urls[0] == urls[1]:
        raise CxbridgeError(f"both sides are {urls[0]}", hint="name two blackboards")
    clock = RealClock()
    bus = EventBus(clock)
    if console is not None:
        bus.subscribe(console, LogLine)
    stop, notifier = threading.Event(), Notifier()
    with ExitStack() as stack:
        stack.enter_context(Interrupt(stop.set, service=True))
        registry = InterfaceRegistry(interface_dirs)
        left, right = (stack.enter_context(open_blackboard(url, registry, clock, bus)) for url in urls)
        gateway = stack.enter_context(Gateway(left, right, patterns, bus=bus, names=urls))
        gateway.start()
        notifier.ready(f"between {urls[0]} and {urls[1]}")
        bus.logger(COMPONENT).info(f"Ready: {', '.join(patterns)} between {urls[0]} and {urls[1]}")
        on_ready(stop.set)
        stop.wait()
        notifier.stopping()
