"""``cx::RosMsgsPlugin``: topics, services and actions of any type, by name."""

from __future__ import annotations

import uuid
from typing import TYPE_CHECKING, Final

from cxbridge.executive.host.values import FALSE, ExternalAddress, Symbol
from cxbridge_ros2.names import parse_type
from cxbridge_ros2cx.cx.ros.action_clients import ActionClients
from cxbridge_ros2cx.cx.ros.messages import FieldError
from cxbridge_ros2cx.cx.ros.plugin import Definition, RosPlugin
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
        self.endpoints = (
            Topics(self, PREFIX),
            ServiceClients(self, PREFIX),
            ServiceServers(self, PREFIX),
            ActionClients(self, PREFIX),
        )

    def init_context(self, env: ClipsEnvironment) -> None:
        functions: tuple[Definition, ...] = (
            ("create-message", lambda text: self.messages.create(parse_type(text)), "sy"),
            ("destroy-message", self.messages.destroy, "e"),
            ("get-field", self._get, "e;sy"),
            ("set-field", self._set, "e;sy;*"),
        )
        self.define_all(env, PREFIX, functions)
        self.define(env, f"{PREFIX}goal-uuid-to-string", self._uuid_text, "m", "y")
        for endpoints in self.endpoints:
            endpoints.define(env)

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

    def _uuid_text(self, numbers: tuple[Value, ...]) -> Value:
        # each integer is cut to a byte
        values = [number & 0xFF for number in numbers if isinstance(number, int)]
        if len(values) != _UUID_BYTES or len(numbers) != _UUID_BYTES:
            self.log.error("Invalid UUID passed, expected multifield of 16 integers")
            return FALSE
        return Symbol(uuid.UUID(bytes=bytes(values)))

    def finalize(self) -> None:
        """Warn about messages that the rules never destroyed."""
        if count := len(self.messages):
            self.log.warn(f"Found {count} message(s), cleaning up ...")
