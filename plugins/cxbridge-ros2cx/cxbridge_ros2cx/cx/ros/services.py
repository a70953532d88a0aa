"""Services in rules: clients whose responses become facts, and servers that call a deffunction."""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from cxbridge.errors import ClipsError, Ros2Error
from cxbridge.executive.host.values import FALSE, ExternalAddress
from cxbridge.rights import Right
from cxbridge_ros2.names import parse_type
from cxbridge_ros2cx.cx.ros.plugin import ADDRESS, INTEGER, STRING, RosPlugin

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2.names import TypeName
    from cxbridge_ros2.node import Client, SendResponse

FIND_S: Final = 1.0  # seconds of real time for discovery of a server after its client is created

_Key = tuple[str, str]  # environment, service


class _OpenClient(Struct, eq=False):
    kind: TypeName
    client: Client
    fact: int | None
    made_s: float
    waiting: list[Mapping[str, Any]] = []  # requests of generated plug-ins that wait for the server


class ServiceClients:
    """The service clients of a plug-in.

    :param prefix: the prefix of functions and templates: ``ros-msgs-``.
    :param kind: the type of all services; None if functions take the type as an argument.
    """

    def __init__(self, plugin: RosPlugin, prefix: str, kind: TypeName | None = None) -> None:
        self._plugin, self._prefix, self._kind = plugin, prefix, kind
        self._clients: dict[_Key, _OpenClient] = {}

    @property
    def _is_newer(self) -> bool:
        """Whether responses of generated plug-ins have request numbers, too."""
        return self._plugin.context.is_newer

    def define(self, env: ClipsEnvironment) -> None:
        plugin, prefix = self._plugin, self._prefix
        plugin.define(env, f"{prefix}destroy-client", partial(self._end, env), "sy")
        if self._kind is None:
            plugin.template(env, f"{prefix}client", service=STRING, type=STRING)
            plugin.template(env, f"{prefix}response", service=STRING, request_id=INTEGER, msg_ptr=ADDRESS)
            plugin.define(env, f"{prefix}create-client", partial(self._create, env), "sy;sy")
            plugin.define(env, f"{prefix}create-request", self._create_request, "sy")
            plugin.define(env, f"{prefix}async-send-request", partial(self._send, env), "e;sy", "bl")
            return
        plugin.template(env, f"{prefix}client", service=STRING)
        plugin.define(env, f"{prefix}create-client", partial(self._create, env), "sy")
        if self._is_newer:
            plugin.template(env, f"{prefix}response", service=STRING, msg_ptr=ADDRESS, request_id=INTEGER)
            plugin.define(env, f"{prefix}send-request", partial(self._send, env), "e;sy", "bl")
            return
        plugin.template(env, f"{prefix}response", service=STRING, msg_ptr=ADDRESS)
        plugin.define(env, f"{prefix}send-request", partial(self._send_later, env), "e;sy", "v")

    def _create(self, env: ClipsEnvironment, service: str, text: str | None = None) -> None:
        key = env.name, str(service)
        if key in self._clients:
            self._plugin.log.warn(f"Already registered to client {service}")
            return
        kind = self._kind if self._kind is not None else parse_type(str(text), "srv")
        client = self._plugin.ros.node.client(self._plugin.ros.reach(service, kind), str(kind))
        slots: dict[str, Value] = {"service": str(service)}
        if self._kind is None:
            slots["type"] = str(text)
        fact = self._plugin.add_fact(env, f"{self._prefix}client", slots)
        self._clients[key] = _OpenClient(kind, client, fact, time.monotonic(), waiting=[])

    def _create_request(self, text: str) -> Value:
        return self._plugin.messages.create(parse_type(text, "srv").derived("Request"))

    def _find(
        self, env: ClipsEnvironment, message: ExternalAddress, service: str
    ) -> tuple[_OpenClient, Mapping[str, Any]]:
        """Return a client, and the fields of a request of its type."""
        entry = self._clients.get((env.name, str(service)))
        if entry is None:
            raise ClipsError(f"there is no client of {service}: create a client first")
        view = self._plugin.messages.find(message)
        if view.kind != entry.kind.derived("Request"):
            raise ClipsError(f"the service {service} has the type {entry.kind}, the message {view.kind}")
        return entry, view.fields

    def _send(self, env: ClipsEnvironment, message: ExternalAddress, service: str) -> Value:
        """Send a request; return its number, or FALSE without a server."""
        entry, fields = self._find(env, message, service)
        if not self._is_served(entry):
            self._plugin.log.warn(f"service {service} not available, abort request.")
            return FALSE
        return self._call(env, str(service), entry, fields)

    def _is_served(self, entry: _OpenClient) -> bool:
        """Return whether a server exists; in real time, wait for its discovery."""
        until_s = entry.made_s + FIND_S
        while not entry.client.is_served:
            if self._plugin.context.clock.is_virtual or time.monotonic() >= until_s:
                return False
            time.sleep(0.01)
        return True

    def _call(
        self, env: ClipsEnvironment, service: str, entry: _OpenClient, fields: Mapping[str, Any]
    ) -> int:
        number, kind = next(self._plugin.ros.requests), entry.kind.derived("Response")

        def done(response: Message) -> None:
            slots: dict[str, Value] = {"service": service}
            if self._kind is None or self._is_newer:
                slots["request-id"] = number
            slots["msg-ptr"] = self._plugin.messages.take(kind, response)
            if (env.name, service) in self._clients:
                self._plugin.add_fact(env, f"{self._prefix}response", slots)

        entry.client.call(fields, done)
        return number

    def _send_later(self, env: ClipsEnvironment, message: ExternalAddress, service: str) -> None:
        """Send a copy of a request as soon as a server exists."""
        entry, fields = self._find(env, message, service)
        if entry.client.is_served and not entry.waiting:
            self._call(env, str(service), entry, fields)
            return
        if not entry.waiting:
            self._plugin.log.warn(f"service {service} not available, start waiting")
        entry.waiting.append(copied(fields))

    def tick(self, environment: Callable[[str], ClipsEnvironment | None]) -> None:
        """Send the requests whose servers have appeared."""
        for (name, service), entry in list(self._clients.items()):
            if entry.waiting and entry.client.is_served and (env := environment(name)) is not None:
                self._plugin.log.info(f"service {service} is finally reachable")
                while entry.waiting:
                    self._call(env, service, entry, entry.waiting.pop(0))

    def _end(self, env: ClipsEnvironment, service: str) -> None:
        entry = self._clients.pop((env.name, str(service)), None)
        if entry is None:
            self._plugin.log.warn(f"Client {service} not found in environment {env.name}")
            return
        entry.client.close()
        if entry.fact is not None:
            env.retract(entry.fact)

    def close(self, env: ClipsEnvironment) -> None:
        """Close the clients that an environment has left open, with a warning."""
        for key in [key for key in self._clients if key[0] == env.name]:
            self._clients.pop(key).client.close()
            self._plugin.log.warn(f"Environment {env.name} has open {key[1]} client, cleaning up ...")


class _OpenService(Struct, eq=False):
    end: Callable[[], None]
    fact: int | None


class ServiceServers:
    """The service servers of a plug-in: a deffunction fills the response to a request.

    :param prefix: the prefix of functions and templates: ``ros-msgs-``.
    :param kind: the type of all services; None if functions take the type as an argument.
    """

    def __init__(self, plugin: RosPlugin, prefix: str, kind: TypeName | None = None) -> None:
        self._plugin, self._prefix, self._kind = plugin, prefix, kind
        self._services: dict[_Key, _OpenService] = {}

    def define(self, env: ClipsEnvironment) -> None:
        plugin, prefix = self._plugin, self._prefix
        if self._kind is None:
            plugin.template(env, f"{prefix}service", service=STRING, type=STRING)
            plugin.define(env, f"{prefix}create-service", partial(self._create, env), "sy;sy")
        else:
            plugin.template(env, f"{prefix}service", name=STRING)
            plugin.define(env, f"{prefix}create-service", partial(self._create, env), "sy")
        plugin.define(env, f"{prefix}destroy-service", partial(self._end, env), "sy")

    def _create(self, env: ClipsEnvironment, service: str, text: str | None = None) -> None:
        key = env.name, str(service)
        if key in self._services:
            self._plugin.log.warn(f"Already registered to service {service}")
            return
        kind = self._kind if self._kind is not None else parse_type(str(text), "srv")
        answer = partial(self._answer, env, str(service), kind)
        end = self._plugin.ros.node.serve_later(
            self._plugin.ros.whole(service), str(kind), answer, needs=Right.CONTROL
        )
        slots: dict[str, Value] = {"name": str(service)}
        if self._kind is None:
            slots = {"service": str(service), "type": str(text)}
        fact = self._plugin.add_fact(env, f"{self._prefix}service", slots)
        self._services[key] = _OpenService(end, fact)

    def _answer(
        self, env: ClipsEnvironment, service: str, kind: TypeName, request: Message, reply: SendResponse
    ) -> None:
        """Call the deffunction for a request at once, and send the response that it filled."""
        function = f"{service if self._kind is None else self._prefix.rstrip('-')}-service-callback"
        messages = self._plugin.messages
        request_address = messages.take(kind.derived("Request"), request)
        response_address = messages.create(kind.derived("Response"))
        try:
            with env.lock:
                if env.has_deffunction(function):
                    env.call(function, service, request_address, response_address)
                else:
                    self._plugin.log.warn(f"{function} not defined, skip callback")
        except ClipsError as error:
            self._plugin.log.error(str(error))
        try:
            reply(messages.find(response_address).fields)
        # the deffunction may have destroyed the response or left a field invalid
        except (Ros2Error, ClipsError) as error:
            self._plugin.log.error(f"{service}: the response cannot be sent: {error}")
            reply({})
        for address in (request_address, response_address):
            messages.destroy(address)

    def _end(self, env: ClipsEnvironment, service: str) -> None:
        entry = self._services.pop((env.name, str(service)), None)
        if entry is None:
            self._plugin.log.warn(f"Service {service} not found in environment {env.name}")
            return
        entry.end()
        if self._kind is None and entry.fact is not None:
            env.retract(entry.fact)

    def close(self, env: ClipsEnvironment) -> None:
        """Close the services that an environment has left open, with a warning."""
        for key in [key for key in self._services if key[0] == env.name]:
            self._services.pop(key).end()
            self._plugin.log.warn(f"Environment {env.name} has open {key[1]} service, cleaning up ...")


def copied(value: Any) -> Any:
    """Return a deep copy of message fields."""
    if isinstance(value, dict):
        return {name: copied(each) for name, each in value.items()}
    return [copied(each) for each in value] if isinstance(value, list) else value
