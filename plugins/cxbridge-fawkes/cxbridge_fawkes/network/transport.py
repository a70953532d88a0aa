"""URLs of Fawkes' network protocol: ``fawkes://host:port``, with optional timeouts in the query."""

from __future__ import annotations

from math import inf
from typing import Any, ClassVar, Final
from urllib.parse import parse_qsl

from cxbridge.blackboard.base import Registry
from cxbridge.blackboard.kit.transport import Transport
from cxbridge.clock import Clock
from cxbridge.errors import BlackBoardError
from cxbridge.events import EventBus
from cxbridge_fawkes.network.client import FawkesBlackBoard

# a timeout of 0 could never succeed; a silence of 0 turns probes of the server off
_MIN_S: Final = {"timeout": 0.01, "silence": 0.0}
_MAX_S: Final = 86_400.0  # a day


class FawkesTransport(Transport):
    """Opens the blackboard of Fawkes at a URL."""

    QUERY_HINT: ClassVar[str] = (
        "write fawkes://HOST:PORT?timeout=SECONDS&silence=SECONDS, either or both, at most a day"
    )

    def open(
        self, url: str, registry: Registry, clock: Clock, bus: EventBus | None, **options: Any
    ) -> FawkesBlackBoard:
        """Connect to the network server of Fawkes.

        :param options: see :class:`cxbridge_fawkes.network.client.FawkesBlackBoard`.
        """
        return FawkesBlackBoard(url, registry, clock, bus, **options)

    def read_query(self, url: str, query: str) -> dict[str, Any]:
        """Return the timeouts of the query, ``timeout`` and ``silence``, in seconds."""
        parameters = dict(parse_qsl(query, keep_blank_values=True))
        try:
            seconds_by_name = {name: float(text) for name, text in parameters.items()}
        except ValueError:
            seconds_by_name = {"": 0.0}  # the check below refuses the unknown name
        # an unknown name has an infinite minimum, so that no value is valid
        if not all(_MIN_S.get(name, inf) <= seconds <= _MAX_S for name, seconds in seconds_by_name.items()):
            raise BlackBoardError(f"'{url}' has an invalid query", hint=self.QUERY_HINT)
        return seconds_by_name
