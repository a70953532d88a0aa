"""The protocol of the thesis' skill board, for callers and performers (docs/evidence/ros2cx.md).

"The thesis" is the executive fawkesrobotics/ros2-clips-executive of 2021, whose caller is the class
SkillExecutionMaster and whose performer is SkillExecution. The protocol extends PlanSys2's protocol by a
skill string, and by the name of a robot, which the thesis' executive leaves empty.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from msgspec.structs import replace

from cxbridge_ros2.hub.caller import HubSkills
from cxbridge_ros2.hub.protocol import ActionKey, Heartbeat, HubMessage, HubProtocol
from cxbridge_ros2.messages import Message


class SkillExecutionProtocol(HubProtocol):
    """The protocol with messages of the type cx_msgs/msg/SkillExecution."""

    name = "skill-execution"
    topic = "/skill_board"
    message_type = "cx_msgs/msg/SkillExecution"
    heartbeat_topic = "/skill_executioner_status"
    heartbeat_type = "cx_msgs/msg/SkillExecutionerInformation"
    arguments_field = "action_parameters"
    progress_field = "progress"
    server_timeout_s = 4.0
    request_lifetime_s = 4.0
    has_skill_strings = True

    def encode_heartbeat(self, heartbeat: Heartbeat, now_us: int) -> Mapping[str, Any]:  # noqa: ARG002 - the message has no stamp
        return {"state": heartbeat.state, "action_name": heartbeat.action, "node_name": heartbeat.node}

    def decode_heartbeat(self, fields: Message) -> Heartbeat:
        return Heartbeat(fields["node_name"], fields["action_name"], fields["state"])

    def make_cancel_reply(self, finish: HubMessage) -> HubMessage | None:
        """Return a FINISH with the status by which the thesis' caller recognises a cancellation."""
        return finish if finish.success else replace(finish, status="CANCELLED", progress=0.0)

    def intended_arguments(self, key: ActionKey) -> tuple[str, ...]:
        """Return the arguments; the thesis' caller sends an empty text for an empty list."""
        return () if key.arguments == ("",) else key.arguments


PROTOCOL = SkillExecutionProtocol()


class SkillExecutionSkills(HubSkills):
    """Executes skills through executor nodes of the thesis."""

    protocol: ClassVar[HubProtocol] = PROTOCOL
