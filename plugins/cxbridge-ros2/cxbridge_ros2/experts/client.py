"""A blocking client for the services of PlanSys2's experts and planner."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import Ros2Error
from cxbridge_ros2.experts.definitions import SERVICE_TYPES
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Client, Node

# Time limit in seconds for a server to appear, and to respond; chosen freely.
DEFAULT_SERVER_TIMEOUT_S: Final = 5.0

_POLL_TIMEOUT_S: Final = 0.05  # time limit of one poll, short so that Ctrl-C takes effect at once


class ExpertRefusedError(Ros2Error):
    """An expert refused a request."""

    exit_status = 1


class ExpertClient:
    """A client of the experts and the planner.

    :param clock: measures the waiting time.
    :param namespace: the prefix of all names.
    :param server_timeout_s: the limit in seconds for a server to appear, and to respond.
    """

    def __init__(
        self,
        node: Node,
        clock: Clock,
        namespace: str = "",
        server_timeout_s: float = DEFAULT_SERVER_TIMEOUT_S,
    ) -> None:
        self.node = node
        self.clock = clock
        self.namespace = namespace
        self._server_timeout_s = server_timeout_s
        self._clients: dict[str, Client] = {}

    def call(
        self, service: str, request: Mapping[str, Any] | None = None, server_timeout_s: float = 0.0
    ) -> Message:
        """Return the response of a service, successful or not.

        :param service: the name of the service, such as ``/problem_expert/get_problem``.
        :param server_timeout_s: the limit in seconds for the response; 0 for the default.
        :raises Ros2Error: if there is no server, the server does not answer, or the request does not have the
            service's type.
        """
        name = self.namespace + service
        if name not in self._clients:  # kept for later calls, since the discovery of a server takes a while
            self._clients[name] = self.node.create_client(name, SERVICE_TYPES[service])
        client = self._clients[name]
        if not self.wait(lambda: client.has_server, self._server_timeout_s):
            raise Ros2Error(
                f"{name} has no server", hint="check 'ros2 service list', the domain and the reach"
            )
        responses: list[Message] = []
        failure_reasons: list[str] = []
        number = client.call(request or {}, responses.append, failure_reasons.append)
        self.wait(lambda: bool(responses or failure_reasons), server_timeout_s or self._server_timeout_s)
        client.forget(number)
        if not responses:
            raise Ros2Error(f"{name}: {failure_reasons[0]}" if failure_reasons else f"{name} does not answer")
        return responses[0]

    def request(
        self, service: str, request: Mapping[str, Any] | None = None, server_timeout_s: float = 0.0
    ) -> Message:
        """Return the response of a service that reports success. The parameters are those of :meth:`call`.

        :raises ExpertRefusedError: if the service reports a failure.
        :raises Ros2Error: as in :meth:`call`.
        """
        response = self.call(service, request, server_timeout_s)
        if not response.get("success", True):
            raise ExpertRefusedError(response["error_info"] or f"{service} has failed")
        return response

    def wait(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Handle messages until a condition is true or the time is over; return whether it became true."""
        end_us = self.clock.now_us() + round(timeout_s * MICROSECONDS)
        while not condition():
            if self.clock.now_us() > end_us:
                return False
            self.node.poll(_POLL_TIMEOUT_S)
        return True
