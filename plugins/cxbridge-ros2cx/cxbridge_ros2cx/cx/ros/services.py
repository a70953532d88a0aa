"""ROS services in rules: clients whose responses become facts, and servers that call a deffunction."""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from cxbridge.errors import ClipsError, Ros2Error
from cxbridge.executive.host.values import FALSE, ExternalAddress
from cxbridge.rights import Right
from cxbridge_ros2cx.cx.ros.plugin import (
    ADDRESS,
    INTEGER,
    STRING,
    ClientEndpoint,
    ClientGroup,
    Endpoint,
    EndpointGroup,
    EndpointTable,
    FunctionDefinition,
    RosPlugin,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2.names import TypeName
    from cxbridge_ros2.node import SendResponse

# real time from the creation of a client to the discovery of its server; the ROS 2 CX waits 1 s, too, though
# from the request
MAX_DISCOVERY_S: Final = 1.0
_POLL_PERIOD_S: Final = 0.01  # time between two checks for the server: short compared to the discovery


class _ServiceClient(ClientEndpoint, kw_only=True):
    """A client of a service.

    :param creation_s: the time of the creation on the monotonic clock.
    """

    creation_s: float


class ServiceClients(ClientGroup[_ServiceClient]):
    """The service clients of a plug-in."""

    client_noun = server_noun = "service"
    message_section = "Request"

    def __init__(self, plugin: RosPlugin, prefix: str, type_name: TypeName | None = None) -> None:
        super().__init__(plugin, prefix, type_name)
        self.clients = EndpointTable(self, "client", "Client {name} not found in environment {env}")
        # generated plug-ins number their requests since pull request 33 of carologistics/clips_executive
        # (June 2026)
        self._has_request_ids = type_name is None or plugin.context.has_2026_changes

    def define(self, env: ClipsEnvironment) -> None:
        plugin, prefix, is_generic = self.plugin, self.prefix, self.type_name is None
        # the orders of the slots are those of the ROS 2 CX, and show in facts
        if is_generic:
            response_slots = {"service": STRING, "request_id": INTEGER, "msg_ptr": ADDRESS}
        else:
            response_slots = {"service": STRING, "msg_ptr": ADDRESS}
            response_slots |= {"request_id": INTEGER} if self._has_request_ids else {}
        plugin.define_template(
            env, f"{prefix}client", service=STRING, **({"type": STRING} if is_generic else {})
        )
        plugin.define_template(env, f"{prefix}response", **response_slots)
        send = partial(self._send_request if self._has_request_ids else self.send, env)
        functions: list[FunctionDefinition] = [
            ("create-client", partial(self._create_client, env), "sy;sy" if is_generic else "sy"),
            ("destroy-client", partial(self.clients.close_endpoint, env), "sy"),
            ("async-send-request" if is_generic else "send-request", send, "e;sy"),
        ]
        if is_generic:
            functions.append(("create-request", self._create_request, "sy"))
        plugin.define_functions(env, prefix, functions)

    def _create_request(self, type_text: str) -> ExternalAddress:
        return self.plugin.messages.create(self.resolve_type(type_text, "srv").derive("Request"))

    def _create_client(self, env: ClipsEnvironment, service: str, type_text: str | None = None) -> None:
        if self.clients.get(env, service) is not None:
            self.plugin.log.warn(f"Already registered to client {service}")
            return
        type_name, ros = self.resolve_type(type_text, "srv"), self.plugin.ros
        client = ros.node.create_client(ros.prepare_client(service, type_name), str(type_name))
        endpoint = _ServiceClient(type_name, client.close, env, client, creation_s=time.monotonic())
        self.clients.add(
            env,
            service,
            endpoint,
            f"{self.prefix}client",
            {"service": str(service)} | self.make_type_slot(type_text),
        )

    def _send_request(self, env: ClipsEnvironment, message: ExternalAddress, service: str) -> Value:
        """Send a request; return its number, or FALSE without a server."""
        client = self.find(env, service)
        fields = self.find_fields(client, message, service)
        if not self._wait_for_server(client):
            self.plugin.log.warn(f"service {service} not available, abort request.")
            return FALSE
        return self.call(str(service), client, fields)

    def _wait_for_server(self, client: _ServiceClient) -> bool:
        """Return whether a server exists; on a real clock, wait for its discovery for a limited time."""
        deadline_s = client.creation_s + MAX_DISCOVERY_S
        while not client.ros_client.has_server:
            if self.plugin.context.clock.is_virtual or time.monotonic() >= deadline_s:
                return False
            time.sleep(_POLL_PERIOD_S)
        return True

    def call(self, name: str, client: _ServiceClient, fields: Mapping[str, Any]) -> int:
        """Send a request and return its number."""
        number = next(self.plugin.ros.request_numbers)

        def add_response(response: Message) -> None:
            slots: dict[str, Value] = {"service": name}
            if self._has_request_ids:
                slots["request-id"] = number
            slots["msg-ptr"] = self.plugin.messages.add_received(
                client.type_name.derive("Response"), response
            )
            if self.clients.get(client.env, name) is not None:  # rules may have destroyed the client
                self.plugin.assert_fact(client.env, f"{self.prefix}response", slots)

        client.ros_client.call(fields, add_response)
        return number


class ServiceServers(EndpointGroup):
    """The service servers of a plug-in: a deffunction fills the response to a request."""

    def __init__(self, plugin: RosPlugin, prefix: str, type_name: TypeName | None = None) -> None:
        super().__init__(plugin, prefix, type_name)
        self._servers: EndpointTable[Endpoint] = EndpointTable(
            self,
            "service",
            "Service {name} not found in environment {env}",
            keeps_facts=type_name is not None,
        )
        self._name_slot = "service" if type_name is None else "name"

    def define(self, env: ClipsEnvironment) -> None:
        types, type_slot = ("sy;sy", {"type": STRING}) if self.type_name is None else ("sy", {})
        self.plugin.define_template(env, f"{self.prefix}service", **{self._name_slot: STRING}, **type_slot)
        self.plugin.define_functions(
            env,
            self.prefix,
            (
                ("create-service", partial(self._create_server, env), types),
                ("destroy-service", partial(self._servers.close_endpoint, env), "sy"),
            ),
        )

    def _create_server(self, env: ClipsEnvironment, service: str, type_text: str | None = None) -> None:
        if self._servers.get(env, service) is not None:
            self.plugin.log.warn(f"Already registered to service {service}")
            return
        type_name = self.resolve_type(type_text, "srv")
        close = self.plugin.ros.node.serve_later(
            self.plugin.ros.full_name(service),
            str(type_name),
            partial(self._handle_request, env, str(service), type_name),
            right=Right.CONTROL,
        )
        self._servers.add(
            env,
            service,
            Endpoint(type_name, close),
            f"{self.prefix}service",
            {self._name_slot: str(service)} | self.make_type_slot(type_text),
        )

    def _handle_request(
        self, env: ClipsEnvironment, service: str, type_name: TypeName, request: Message, reply: SendResponse
    ) -> None:
        """Call the deffunction for a request at once, and send the response that the deffunction filled."""
        deffunction = f"{service if self.type_name is None else self.prefix.rstrip('-')}-service-callback"
        messages, log = self.plugin.messages, self.plugin.log
        request_address = messages.add_received(type_name.derive("Request"), request)
        response_address = messages.create(type_name.derive("Response"))
        try:
            with env.lock:
                if env.has_deffunction(deffunction):
                    env.call(deffunction, service, request_address, response_address)
                else:
                    log.warn(f"{deffunction} not defined, skip callback")
        except ClipsError as error:
            log.error(str(error))
        try:
            reply(messages.find(response_address).fields)
        # the deffunction may have destroyed the response or left a field invalid
        except (Ros2Error, ClipsError) as error:
            log.error(f"{service}: the response cannot be sent: {error}")
            reply({})  # default values: without any response the client would wait forever
        for address in (request_address, response_address):
            messages.destroy(address)
