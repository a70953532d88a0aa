"""The base of transports: how the URLs of one scheme become blackboards."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

from cxbridge.blackboard.base import BlackBoard, Registry
from cxbridge.clock import Clock
from cxbridge.errors import BlackBoardError
from cxbridge.events import EventBus


class BadUrlError(BlackBoardError):
    """The URL names no blackboard."""


class Transport(ABC):
    """Opens the blackboards of some schemes of URLs; one line in :mod:`cxbridge.blackboard.urls` a scheme."""

    QUERY_HINT: ClassVar[str] = "leave away the '?' and what follows it"
    """The hint for an invalid query."""

    @abstractmethod
    def open(
        self, url: str, registry: Registry, clock: Clock, bus: EventBus | None, **options: Any
    ) -> BlackBoard:
        """Return the blackboard at ``url``, connected.

        :param url: without a query.
        :param options: further options of the transport.
        :raises BlackBoardError: when the URL is invalid, or no server answers.
        """

    def read_query(self, url: str, query: str) -> dict[str, Any]:
        """Return the options that the query of a URL stands for; there are none unless a transport says so.

        :raises BlackBoardError: when it is invalid.
        """
        raise BlackBoardError(f"'{url}' takes no '?{query}'", hint=self.QUERY_HINT)
