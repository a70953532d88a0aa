"""The objects of the web server that its endpoints share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cxbridge_web.event_collector import EventCollector
    from cxbridge_web.event_streams import EventStreams
    from cxbridge_web.navgraphs import NavGraphs


@dataclass(frozen=True, slots=True)
class ServerState:
    """The shared objects of the web server.

    :param streams: the event streams of the clients.
    :param collector: the source of the event streams; counts the firings of rules while a client requests
        them.
    :param navgraphs: the loaded navigation graphs.
    """

    streams: EventStreams
    collector: EventCollector
    navgraphs: NavGraphs
