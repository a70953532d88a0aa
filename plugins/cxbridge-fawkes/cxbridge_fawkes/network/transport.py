"""URLs of Fawkes' network protocol: ``fawkes://host:port``."""

from __future__ import annotations

from typing import Any

from cxbridge.blackboard.base import Registry
from cxbridge.blackboard.kit.transport import Transport
from cxbridge.clock import Clock
from cxbridge.events import EventBus
from cxbridge_fawkes.network.client import FawkesBlackBoard


class FawkesTransport(Transport):
    """Opens the blackboard of Fawkes at a URL."""

    def open(
        self, url: str, registry: Registry, clock: Clock, bus: EventBus | None, **options: Any
    ) -> FawkesBlackBoard:
        """Connect to the network server of Fawkes.

        :param options: see :class:`cxbridge_fawkes.network.client.FawkesBlackBoard`.
        """
        return FawkesBlackBoard(url, registry, clock, bus, **options)
