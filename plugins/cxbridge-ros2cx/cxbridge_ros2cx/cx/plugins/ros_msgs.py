"""The plug-in ``cx::RosMsgsPlugin``: topics, services and action clients of any ROS type.

Functions for rules take the type as an argument, in place of a generated plug-in for each type.
"""

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

NAME_PREFIX: Final = "ros-msgs-"
_UUID_BYTES: Final = 16  # the length of a goal's id in action_msgs


class RosMsgsPlugin(RosPlugin):
    """Defines the functions ``ros-msgs-...``."""

    def initialize(self) -> None:
        self.endpoint_groups = (
            Topics(self, NAME_PREFIX),
            ServiceClients(self, NAME_PREFIX),
            ServiceServers(self, NAME_PREFIX),
            ActionClients(self, NAME_PREFIX),
        )

    def init_context(self, env: ClipsEnvironment) -> None:
        # the last element of a row has the types of the arguments in the codes of CLIPS
        self.define_functions(
            env,
            NAME_PREFIX,
            (
                ("create-message", lambda type_text: self.messages.create(parse_type(type_text)), "sy"),
                ("destroy-message", self.messages.destroy, "e"),
                ("get-field", self._get_field, "e;sy"),
                ("set-field", self._set_field, "e;sy;*"),
                ("goal-uuid-to-string", self._format_uuid, "m"),
            ),
        )
        for group in self.endpoint_groups:
            group.define(env)

    def _get_field(self, address: ExternalAddress, field: str) -> Value:
        try:
            return self.messages.get(address, field)
        except FieldError as error:
            self.log.error(f"Failed to retrieve field {field}: {error}")
            return FALSE

    def _set_field(self, address: ExternalAddress, field: str, value: Value) -> None:
        try:
            self.messages.set(address, field, value)
        except FieldError as error:
            self.log.error(f"Failed to set field {field}: {error}")

    def _format_uuid(self, numbers: tuple[Value, ...]) -> Value:
        # as in C++, an integer is cut to a byte
        octets = [number & 0xFF for number in numbers if isinstance(number, int)]
        if len(octets) != _UUID_BYTES or len(numbers) != _UUID_BYTES:
            self.log.error("Invalid UUID passed, expected multifield of 16 integers")
            return FALSE
        return Symbol(uuid.UUID(bytes=bytes(octets)))

    def finalize(self) -> None:
        """Warn about messages that the rules never destroyed."""
        if count := len(self.messages):
            # the text of the original; here, the messages are freed with the node
            self.log.warn(f"Found {count} message(s), cleaning up ...")
