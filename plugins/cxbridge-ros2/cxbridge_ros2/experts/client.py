"""Blocking client for the services of PlanSys2's experts and planner."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import Ros2Error
from cxbridge_ros2.experts.names import SERVICES
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Client, Node

PATIENCE_S: Final = 5.0  # default limit in seconds for a server to appear, and to answer

_SLICE_S: Final = 0.05  # seconds of one poll, short enough for Ctrl-C
_AGAIN_S: Final = 2.0  # seconds after which a request is repeated
# Read-only services, which may be called again: a server that has just met a client loses its response.
_HARMLESS: Final = ("get_domain", "get_problem", "exist_", "is_")


class ExpertRefusedError(Ros2Error):
    """An expert refused a request."""


class ExpertClient:
    """Client of the experts.

    :param clock: measures the waiting time.
    :param namespace: the prefix of all names.
    """

    def __init__(self, node: Node, clock: Clock, namespace: str = "", patience_s: float = PATIENCE_S) -> None:
        self.node = node
        self.clock = clock
        self.namespace = namespace
        self._patience_s = patience_s
        self._clients: dict[str, Client] = {}

    def ask(self, service: str, request: Mapping[str, Any] | None = None, patience_s: float = 0.0) -> Message:
        """Return the response of a service, successful or not.

        :param service: such as ``/problem_expert/get_problem``.
        :param patience_s: the limit in seconds for the response; 0 for the default.
        :raises Ros2Error: if there is no server, or the server does not answer.
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

        :raises ExpertRefusedError: if the service reports a failure.
        :raises Ros2Error: if no server answers.
        """
        response = self.ask(service, request, patience_s)
        if not response.get("success", True):
            raise ExpertRefusedError(response["error_info"] or f"{service} has failed")
        return response

    def wait(self, enough: Callable[[], bool], seconds: float) -> bool:
        """Handle messages until the condition holds or the time is over; return whether it holds."""
        end_us = self.clock.now_us() + round(seconds * MICROSECONDS)
        while not enough():
            if self.clock.now_us() > end_us:
                return False
            self.node.poll(_SLICE_S)
        return True
