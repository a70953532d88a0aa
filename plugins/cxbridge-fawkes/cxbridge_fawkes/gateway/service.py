"""A gateway as a separate process."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from cxbridge.blackboard.patterns import Pattern
from cxbridge.daemon.services.service import ReadyCallback, Service, do_nothing
from cxbridge.errors import CxbridgeError
from cxbridge.events import Sink
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge_fawkes.gateway import Gateway
from cxbridge_fawkes.gateway.gateway import COMPONENT


def run_gateway(
    urls: tuple[str, str],
    patterns: Sequence[str],
    *,
    interface_dirs: Iterable[Path] = (),
    console: Sink | None = None,
    on_ready: ReadyCallback = do_nothing,
) -> None:
    """Mirror interfaces between the blackboards at two URLs until SIGINT, SIGTERM or SIGHUP.

    :param console: gets the log lines.
    :param on_ready: called when both blackboards are connected, with a function that ends the gateway.
    :raises CxbridgeError: if a server does not answer, a pattern is invalid, or the URLs are equal.
    """
    for pattern in patterns:
        Pattern.parse(pattern)  # called for its errors: the gateway parses patterns after the connections
    if urls[0] == urls[1]:
        raise CxbridgeError(f"both sides are {urls[0]}", hint="name two blackboards")
    with Service(console, on_ready) as service:
        registry = InterfaceRegistry(interface_dirs)
        left, right = (service.open_blackboard(url, registry) for url in urls)
        gateway = service.enter_context(Gateway(left, right, patterns, bus=service.bus, names=urls))
        gateway.start()
        between_text = f"between {urls[0]} and {urls[1]}"
        service.bus.logger(COMPONENT).info(f"Ready: {', '.join(patterns)} {between_text}")
        service.report_ready(between_text)
        service.stopped.wait()
