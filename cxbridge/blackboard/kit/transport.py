"""The base class of transports, which open the blackboards of URLs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

from cxbridge.blackboard.base import BlackBoard, Registry
from cxbridge.clock import Clock
from cxbridge.errors import BlackBoardError
from cxbridge.events import EventBus


class BadUrlError(BlackBoardError):
    """A URL does not denote a blackboard."""


class Transport(ABC):
    """Opens the blackboards of some URL schemes, see :data:`cxbridge.blackboard.urls.TRANSPORTS`."""

    QUERY_HINT: ClassVar[str] = "omit the '?' and the text after it"
    """The hint for an invalid query."""

    @abstractmethod
    def open(
        self, url: str, registry: Registry, clock: Clock, bus: EventBus | None, **options: Any
    ) -> BlackBoard:
        """Return the blackboard at ``url``, connected.

        :param url: a URL without query.
        :param options: the options from :meth:`read_query`, and further arguments of the blackboard's class.
        :raises BlackBoardError: if the URL is invalid, or no server replies.
        """

    def read_query(self, url: str, query: str) -> dict[str, Any]:
        """Return the options of a URL's query, as arguments for :meth:`open`.

        A transport without such options refuses all queries.

        :raises BlackBoardError: if the query is invalid.
        """
        raise BlackBoardError(f"'{url}' does not support the query '?{query}'", hint=self.QUERY_HINT)
