"""Services in rules: clients whose responses are facts, servers that call a deffunction."""

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
    from cxbridge_ros2.node import Client, Reply

FIND_S: Final = 1.0
"""Seconds of real time that a server may take to be found after its client was made."""

_Key = tuple[str, str]  # environment, service


class _OpenClient(Struct, eq=False):
    kind: TypeName
    client: Client
    fact: int | None
    made_s: float
    waiting: list[Mapping[str, Any]] = []
    """Requests that wait for the server, of generated plug-ins."""


class ServiceClients:
    """The clients of a plug-in.

    :param prefix: how functions and templates begin: ``ros-msgs-``.
    :param kind: the type of all services; None: functions have the type as argument.
    """

    def __init__(self, plugin: RosPlugin, prefix: str, kind: TypeName | None = None) -> None:
        self._plugin, self._prefix, self._kind = plugin, prefix, kind
        self._clients: dict[_Key, _OpenClient] = {}

    @property
    def _is_newer(self) -> bool:
        """Whether responses have the numbers of their requests in generated plug-ins, too."""
        return self._plugin.context.is_newer

    def define(self, env: ClipsEnvironment) -> None:
        """Define functions and templates."""
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
        """Return a client, and the fields of a request that it can send."""
        found = self._clients.get((env.name, str(service)))
        if found is None:
            raise ClipsError(f"there is no client of {service}: create a client first")
        view = self._plugin.messages.find(message)
        if view.kind != found.kind.derived("Request"):
            raise ClipsError(f"the service {service} has the type {found.kind}, the message {view.kind}")
        return found, view.fields

    def _send(self, env: ClipsEnvironment, message: ExternalAddress, service: str) -> Value:
        """Send a request; return its number, or FALSE without a server."""
        found, fields = self._find(env, message, service)
        if not self._is_served(found):
            self._plugin.log.warn(f"service {service} not available, abort request.")
            return FALSE
        return self._call(env, str(service), found, fields)

    def _is_served(self, found: _OpenClient) -> bool:
        """Return whether there is a server; in real time it may take a while until it is found."""
        until_s = found.made_s + FIND_S
        while not found.client.is_served:
            if self._plugin.context.clock.is_virtual or time.monotonic() >= until_s:
                return False
            time.sleep(0.01)
        return True

    def _call(
        self, env: ClipsEnvironment, service: str, found: _OpenClient, fields: Mapping[str, Any]
    ) -> int:
        number, kind = next(self._plugin.ros.requests), found.kind.derived("Response")

        def done(response: Message) -> None:
            slots: dict[str, Value] = {"service": service}
            if self._kind is None or self._is_newer:
                slots["request-id"] = number
            slots["msg-ptr"] = self._plugin.messages.take(kind, response)
            if (env.name, service) in self._clients:
                self._plugin.add_fact(env, f"{self._prefix}response", slots)

        found.client.call(fields, done)
        return number

    def _send_later(self, env: ClipsEnvironment, message: ExternalAddress, service: str) -> None:
        """Send a copy of a request as soon as there is a server."""
        found, fields = self._find(env, message, service)
        if found.client.is_served and not found.waiting:
            self._call(env, str(service), found, fields)
            return
        if not found.waiting:
            self._plugin.log.warn(f"service {service} not available, start waiting")
        found.waiting.append(copied(fields))

    def tick(self, environment: Callable[[str], ClipsEnvironment | None]) -> None:
        """Send the requests whose servers have appeared."""
        for (name, service), found in list(self._clients.items()):
            if found.waiting and found.client.is_served and (env := environment(name)) is not None:
                self._plugin.log.info(f"service {service} is finally reachable")
                while found.waiting:
                    self._call(env, service, found, found.waiting.pop(0))

    def _end(self, env: ClipsEnvironment, service: str) -> None:
        found = self._clients.pop((env.name, str(service)), None)
        if found is None:
            self._plugin.log.warn(f"Client {service} not found in environment {env.name}")
            return
        found.client.close()
        if found.fact is not None:
            env.retract(found.fact)

    def close(self, env: ClipsEnvironment) -> None:
        """End the clients that an environment has left open, and warn of them."""
        for key in [key for key in self._clients if key[0] == env.name]:
            self._clients.pop(key).client.close()
            self._plugin.log.warn(f"Environment {env.name} has open {key[1]} client, cleaning up ...")


class _OpenService(Struct, eq=False):
    end: Callable[[], None]
    fact: int | None


class ServiceServers:
    """The servers of a plug-in: a request calls a deffunction, which sets the fields of the response.

    :param prefix: how functions and templates begin: ``ros-msgs-``.
    :param kind: the type of all services; None: functions have the type as argument.
    """

    def __init__(self, plugin: RosPlugin, prefix: str, kind: TypeName | None = None) -> None:
        self._plugin, self._prefix, self._kind = plugin, prefix, kind
        self._services: dict[_Key, _OpenService] = {}

    def define(self, env: ClipsEnvironment) -> None:
        """Define functions and templates."""
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
        self, env: ClipsEnvironment, service: str, kind: TypeName, request: Message, reply: Reply
    ) -> None:
        """Call the deffunction for a request at once, and send the response that it has filled."""
        function = f"{service if self._kind is None else self._prefix.rstrip('-')}-service-callback"
        messages = self._plugin.messages
        given = messages.take(kind.derived("Request"), request)
        made = messages.create(kind.derived("Response"))
        try:
            with env.lock:
                if env.has_deffunction(function):
                    env.call(function, service, given, made)
                else:
                    self._plugin.log.warn(f"{function} not defined, skip callback")
        except ClipsError as error:
            self._plugin.log.error(str(error))
        try:
            reply(messages.find(made).fields)
        except (Ros2Error, ClipsError) as error:
            self._plugin.log.error(f"{service}: the response cannot be sent: {error}")
            reply({})
        for address in (given, made):
            messages.destroy(address)

    def _end(self, env: ClipsEnvironment, service: str) -> None:
        found = self._services.pop((env.name, str(service)), None)
        if found is None:
            self._plugin.log.warn(f"Service {service} not found in environment {env.name}")
            return
        found.end()
        if self._kind is None and found.fact is not None:
            env.retract(found.fact)

    def close(self, env: ClipsEnvironment) -> None:
        """End the services that an environment has left open, and warn of them."""
        for key in [key for key in self._services if key[0] == env.name]:
            self._services.pop(key).end()
            self._plugin.log.warn(f"Environment {env.name} has open {key[1]} service, cleaning up ...")


def copied(value: Any) -> Any:
    """Return a copy of fields, of which rules may change the original."""
    if isinstance(value, dict):
        return {name: copied(each) for name, each in value.items()}
    return [copied(each) for each in value] if isinstance(value, list) else value
