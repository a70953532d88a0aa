"""Clients of services over rosbridge."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import count
from typing import Any

from cxbridge_ros2.node import Client, Failed, Receive
from cxbridge_ros2.transports.rosbridge.connection import RosbridgeConnection


class ServiceClient(Client):
    """A client that calls one after the other: the server of rosbridge_suite loses some concurrent calls.

    :param encode: converts a request to JSON.
    :param send: sends a request and calls one of both functions with the result.
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
        self._active_number: int | None = None

    def call(self, request: Mapping[str, Any], done: Receive, failed: Failed | None = None) -> int:
        """Send a request after the earlier ones have ended."""
        number = next(self._numbers)
        self._waiting[number] = (self._encode(request), done, failed)
        self._next()
        return number

    def forget(self, number: int) -> None:
        self._waiting.pop(number, None)
        if number == self._active_number:  # its response may never arrive
            self._active_number = None
            self._next()

    def _next(self) -> None:
        if self._active_number is not None or not self._waiting:
            return
        number = self._active_number = next(iter(self._waiting))
        args, done, failed = self._waiting[number]

        def ended(receive: Callable[[Any], None] | None, answer: Any) -> None:
            is_waited_for = self._waiting.pop(number, None) is not None
            if self._active_number == number:
                self._active_number = None
                self._next()
            if is_waited_for and receive is not None:
                receive(answer)

        self._send(args, partial(ended, done), partial(ended, failed))

    @property
    def servers(self) -> frozenset[int]:
        """A number that changes with each reconnection."""
        return frozenset({self._connection.connections}) if self._connection.is_up else frozenset()

    def close(self) -> None:
        """Do nothing: the bridge stores nothing for a client."""
