"""``cx::RosMsgsPlugin``: topics, services and actions of any type, by name."""

from __future__ import annotations

import uuid
from typing import TYPE_CHECKING, Final

from cxbridge.executive.host.values import FALSE, ExternalAddress, Symbol
from cxbridge_ros2.names import parse_type
from cxbridge_ros2cx.cx.ros.action_clients import ActionClients
from cxbridge_ros2cx.cx.ros.messages import FieldError
from cxbridge_ros2cx.cx.ros.plugin import RosPlugin
from cxbridge_ros2cx.cx.ros.services import ServiceClients, ServiceServers
from cxbridge_ros2cx.cx.ros.topics import Topics

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value

PREFIX: Final = "ros-msgs-"
_UUID_BYTES: Final = 16  # a goal's id in action_msgs


class RosMsgsPlugin(RosPlugin):
    """Messages, topics, services, and clients of services and actions, selected by type name."""

    def initialize(self) -> None:
        self._environments: dict[str, ClipsEnvironment] = {}
        self._clients = ServiceClients(self, PREFIX)
        self._actions = ActionClients(self, PREFIX)
        self._parts = (Topics(self, PREFIX), self._clients, ServiceServers(self, PREFIX), self._actions)

    def init_context(self, env: ClipsEnvironment) -> None:
        self._environments[env.name] = env
        create, messages = f"{PREFIX}create-message", self.messages
        self.define(env, create, lambda text: messages.create(parse_type(text)), "sy")
        self.define(env, f"{PREFIX}destroy-message", messages.destroy, "e")
        self.define(env, f"{PREFIX}get-field", self._get, "e;sy")
        self.define(env, f"{PREFIX}set-field", self._set, "e;sy;*")
        self.define(env, f"{PREFIX}goal-uuid-to-string", self._uuid, "m", "y")
        for part in self._parts:
            part.define(env)

    def _get(self, address: ExternalAddress, field: str) -> Value:
        try:
            return self.messages.get(address, field)
        except FieldError as error:
            self.log.error(f"Failed to retrieve field {field}: {error}")
            return FALSE

    def _set(self, address: ExternalAddress, field: str, value: Value) -> None:
        try:
            self.messages.set(address, field, value)
        except FieldError as error:
            self.log.error(f"Failed to set field {field}: {error}")

    def _uuid(self, numbers: tuple[Value, ...]) -> Value:
        values = [each & 0xFF for each in numbers if isinstance(each, int)]
        if len(values) != _UUID_BYTES or len(numbers) != _UUID_BYTES:
            self.log.error("Invalid UUID passed, expected multifield of 16 integers")
            return FALSE
        return Symbol(uuid.UUID(bytes=bytes(values)))

    def tick(self) -> None:
        """Send requests that were waiting for their server."""
        self._clients.tick(self._environments.get)
        self._actions.tick()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Close the environment's open requests."""
        for part in self._parts:
            part.close(env)
        self._environments.pop(env.name, None)

    def finalize(self) -> None:
        """Warn about messages that the rules never destroyed."""
        left = len(self.messages)
        if left:
            self.log.warn(f"Found {left} message(s), cleaning up ...")
