"""The protocol of PlanSys2's hub, for callers and performers (docs/ros2.md).

The hub is the topic ``/actions_hub``, on which callers find performers for actions. In PlanSys2, the caller
is the class ActionExecutor and the performer is ActionExecutorClient. The protocol has not changed since
ROS 2 Foxy.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from cxbridge_ros2.hub.caller import HubSkills
from cxbridge_ros2.hub.protocol import ActionKey, Heartbeat, HubMessage, HubProtocol
from cxbridge_ros2.messages import Message
from cxbridge_ros2.stamps import us_to_stamp


class PlanSys2Protocol(HubProtocol):
    """The protocol with messages of the type plansys2_msgs/msg/ActionExecution."""

    name = "plansys2"
    topic = "/actions_hub"
    message_type = "plansys2_msgs/msg/ActionExecution"
    heartbeat_topic = "/performers_status"
    heartbeat_type = "plansys2_msgs/msg/ActionPerformerStatus"
    arguments_field = "arguments"
    progress_field = "completion"
    # ActionExecutor repeats a REQUEST after 1 s, and gives up after 30 s
    server_timeout_s = 30.0
    request_lifetime_s = 1.0

    def encode_heartbeat(self, heartbeat: Heartbeat, now_us: int) -> Mapping[str, Any]:
        return {
            "status_stamp": us_to_stamp(now_us),
            "state": heartbeat.state,
            "action": heartbeat.action,
            "node_name": heartbeat.node,
        }

    def decode_heartbeat(self, fields: Message) -> Heartbeat:
        return Heartbeat(fields["node_name"], fields["action"], fields["state"])

    def make_cancel_reply(self, finish: HubMessage) -> HubMessage | None:  # noqa: ARG002
        """Return None, since PlanSys2's performers stop silently and its executor expects no message."""
        return None

    def intended_arguments(self, key: ActionKey) -> tuple[str, ...]:
        """Return the arguments; PlanSys2's executor sends the name of the action for an empty list."""
        return () if key.arguments == (key.action,) else key.arguments


PROTOCOL = PlanSys2Protocol()


class PlanSys2Skills(HubSkills):
    """Executes skills through action performers of PlanSys2."""

    protocol: ClassVar[HubProtocol] = PROTOCOL
