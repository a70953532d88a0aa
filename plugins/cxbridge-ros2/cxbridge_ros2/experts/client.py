"""Asks the services of PlanSys2's experts and planner, ours or its own, and waits for the answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import Ros2Error
from cxbridge_ros2.experts.names import SERVICES
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Client, Node

PATIENCE_S: Final = 5.0
"""Seconds that a server may need to appear, and to answer."""

_SLICE_S: Final = 0.05
_AGAIN_S: Final = 2.0
_HARMLESS: Final = ("get_domain", "get_problem", "exist_", "is_")
"""What may be asked again: a server that has only just met a client loses its response."""


class ExpertRefusedError(Ros2Error):
    """An expert refused a request."""


class ExpertClient:
    """Asks.

    :param node: of ROS 2.
    :param clock: measures how long it waits.
    :param namespace: the prefix of all names.
    :param patience_s: see :data:`PATIENCE_S`.
    """

    def __init__(self, node: Node, clock: Clock, namespace: str = "", patience_s: float = PATIENCE_S) -> None:
        self.node = node
        self.clock = clock
        self.namespace = namespace
        self._patience_s = patience_s
        self._clients: dict[str, Client] = {}

    def ask(self, service: str, request: Mapping[str, Any] | None = None, patience_s: float = 0.0) -> Message:
        """Return the response of a service, successful or not.

        :param service: e.g. ``/problem_expert/get_problem``.
        :param patience_s: seconds that it may take to answer; 0: as always.
        :raises Ros2Error: when there is no server, or it does not answer.
        """
        name = self.namespace + service
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = self.node.client(name, SERVICES[service])
        if not self.wait(lambda: client.is_served, self._patience_s):
            raise Ros2Error(f"{name} has no server", hint="see 'ros2 service list', the domain and the reach")
        got: list[Message] = []
        failed: list[str] = []
        end_us = self.clock.now_us() + round((patience_s or self._patience_s) * MICROSECONDS)
        numbers: list[int] = []
        while not (got or failed) and self.clock.now_us() < end_us:
            if not numbers or service.rpartition("/")[2].startswith(_HARMLESS):
                numbers.append(client.call(request or {}, got.append, failed.append))
            left_s = (end_us - self.clock.now_us()) / MICROSECONDS
            self.wait(lambda: bool(got or failed), min(_AGAIN_S, left_s))
        for number in numbers:
            client.forget(number)
        if not got:
            raise Ros2Error(f"{name}: {failed[0]}" if failed else f"{name} does not answer")
        return got[0]

    def do(self, service: str, request: Mapping[str, Any] | None = None, patience_s: float = 0.0) -> Message:
        """Return the successful response of a service.

        :raises ExpertRefusedError: when the service reports a failure; with its reason.
        :raises Ros2Error: when no server answers.
        """
        response = self.ask(service, request, patience_s)
        if not response.get("success", True):
            raise ExpertRefusedError(response["error_info"] or f"{service} has failed")
        return response

    def wait(self, enough: Callable[[], bool], seconds: float) -> bool:
        """Handle messages until the condition is true, or the time is over; return whether it is true."""
        end_us = self.clock.now_us() + round(seconds * MICROSECONDS)
        while not enough():
            if self.clock.now_us() > end_us:
                return False
            self.node.poll(_SLICE_S)
        return True
