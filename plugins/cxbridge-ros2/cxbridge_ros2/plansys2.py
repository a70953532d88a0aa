"""The protocol of PlanSys2's hub, for callers and performers (docs/ros2.md).

In PlanSys2, the caller is ActionExecutor and the performer is ActionExecutorClient. The protocol has not
changed since ROS 2 Foxy.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from cxbridge_ros2.hub.caller import HubSkills
from cxbridge_ros2.hub.protocol import ActionKey, Heartbeat, HubMessage, HubProtocol
from cxbridge_ros2.messages import Message
from cxbridge_ros2.stamps import stamp_of


class PlanSys2Protocol(HubProtocol):
    """Messages as plansys2_msgs/msg/ActionExecution."""

    name = "plansys2"
    topic = "/actions_hub"
    message_type = "plansys2_msgs/msg/ActionExecution"
    heartbeat_topic = "/performers_status"
    heartbeat_type = "plansys2_msgs/msg/ActionPerformerStatus"
    arguments_field = "arguments"
    progress_field = "completion"
    patience_s = 30.0
    request_lifetime_s = 1.0

    def encode_heartbeat(self, heartbeat: Heartbeat, now_us: int) -> Mapping[str, Any]:
        return {
            "status_stamp": stamp_of(now_us),
            "state": heartbeat.state,
            "action": heartbeat.action,
            "node_name": heartbeat.node,
        }

    def decode_heartbeat(self, fields: Message) -> Heartbeat:
        return Heartbeat(fields["node_name"], fields["action"], fields["state"])

    def after_cancel(self, finish: HubMessage) -> HubMessage | None:  # noqa: ARG002
        """Return None: PlanSys2's performers stop silently, and its executor expects no message."""
        return None

    def arguments_of(self, key: ActionKey) -> tuple[str, ...]:
        """Return the arguments; PlanSys2's executor sends the action's name in place of no argument."""
        return () if key.arguments == (key.action,) else key.arguments


PROTOCOL = PlanSys2Protocol()


class PlanSys2Skills(HubSkills):
    """Executes skills through action performers of PlanSys2."""

    protocol: ClassVar[HubProtocol] = PROTOCOL
