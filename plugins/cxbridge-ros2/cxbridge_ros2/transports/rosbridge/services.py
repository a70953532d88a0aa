"""Clients of services over rosbridge."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import count
from typing import Any

from cxbridge_ros2.node import Client, Failed, Receive
from cxbridge_ros2.transports.rosbridge.connection import RosbridgeConnection


class ServiceClient(Client):
    """Calls one after the other: the server of rosbridge_suite loses some of those that come at once.

    :param encode: makes JSON of a request.
    :param send: sends a request as JSON; calls one of both functions with the result.
    """

    def __init__(
        self,
        connection: RosbridgeConnection,
        encode: Callable[[Mapping[str, Any]], Any],
        send: Callable[[Any, Receive, Failed], None],
    ) -> None:
        self._connection, self._encode, self._send = connection, encode, send
        self._numbers = count(1)
        self._waiting: dict[int, tuple[Any, Receive, Failed | None]] = {}
        self._under_way: int | None = None

    def call(self, request: Mapping[str, Any], done: Receive, failed: Failed | None = None) -> int:
        """Send a request when those before it have ended; see the base class."""
        number = next(self._numbers)
        self._waiting[number] = (self._encode(request), done, failed)
        self._next()
        return number

    def forget(self, number: int) -> None:
        """Wait for a response no longer; see the base class."""
        self._waiting.pop(number, None)
        if number == self._under_way:  # whose response may never come
            self._under_way = None
            self._next()

    def _next(self) -> None:
        if self._under_way is not None or not self._waiting:
            return
        number = self._under_way = next(iter(self._waiting))
        args, done, failed = self._waiting[number]

        def ended(receive: Callable[[Any], None] | None, answer: Any) -> None:
            is_waited_for = self._waiting.pop(number, None) is not None
            if self._under_way == number:
                self._under_way = None
                self._next()
            if is_waited_for and receive is not None:
                receive(answer)

        self._send(args, partial(ended, done), partial(ended, failed))

    @property
    def servers(self) -> frozenset[int]:
        """A number while the bridge is connected, another one after a reconnection."""
        return frozenset({self._connection.connections}) if self._connection.is_up else frozenset()

    def close(self) -> None:
        """Do nothing: the bridge keeps nothing for a client."""
