"""URLs of the ZeroMQ transport: ``tcp://`` and ``ipc://``, with keys in the query."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar
from urllib.parse import parse_qsl

from cxbridge.blackboard.base import Registry
from cxbridge.blackboard.kit.transport import Transport
from cxbridge.blackboard.zmq.client import ZmqBlackBoard
from cxbridge.blackboard.zmq.security import CurveClient, uses_curve
from cxbridge.clock import Clock
from cxbridge.errors import BlackBoardError
from cxbridge.events import EventBus


class ZmqTransport(Transport):
    """Opens blackboards over ZeroMQ."""

    QUERY_HINT: ClassVar[str] = (
        "write tcp://HOST:PORT?key=FILE&server-key=FILE, or tcp://HOST:PORT?insecure=yes"
    )

    def open(
        self, url: str, registry: Registry, clock: Clock, bus: EventBus | None, **options: Any
    ) -> ZmqBlackBoard:
        """Return the blackboard at an endpoint.

        :param options: arguments of :class:`~cxbridge.blackboard.zmq.ZmqBlackBoard`.
        """
        return ZmqBlackBoard(url, registry, clock, bus, **options)

    def read_query(self, url: str, query: str) -> dict[str, Any]:
        """Return the keys of the query, and whether the query allows a connection without keys.

        :raises BlackBoardError: if keys have no effect, a key is missing, or a parameter is unknown.
        """
        if not uses_curve(url):  # keys would have no effect, so the transport refuses the query
            return super().read_query(url, query)
        parameters = dict(parse_qsl(query, keep_blank_values=True))
        options: dict[str, Any] = {"insecure": parameters.pop("insecure", "no") == "yes"}
        if parameters:
            if parameters.keys() != {"key", "server-key"}:
                raise BlackBoardError(
                    f"'{url}' must have both keys and no other parameter", hint=self.QUERY_HINT
                )
            options["keys"] = CurveClient(Path(parameters["key"]), Path(parameters["server-key"]))
        return options
