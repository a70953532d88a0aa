"""The protocol of the skill board of ros2-clips-executive, for callers and performers.

ros2-clips-executive (fawkesrobotics, 2021) is the executive of a thesis; see docs/evidence/ros2cx.md. The
caller is its class SkillExecutionMaster, the performer its class SkillExecution. The protocol extends that of
PlanSys2 by a skill string, and by the name of a robot, which SkillExecutionMaster leaves empty.
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
    # SkillExecutionMaster never repeats a REQUEST, and gives up after 4 s
    server_timeout_s = 4.0
    request_lifetime_s = 4.0
    has_skill_strings = True

    def encode_heartbeat(self, heartbeat: Heartbeat, now_us: int) -> Mapping[str, Any]:  # noqa: ARG002 - the message has no stamp
        return {"state": heartbeat.state, "action_name": heartbeat.action, "node_name": heartbeat.node}

    def decode_heartbeat(self, fields: Message) -> Heartbeat:
        return Heartbeat(fields["node_name"], fields["action_name"], fields["state"])

    def make_cancel_reply(self, finish: HubMessage) -> HubMessage | None:
        """Return a FINISH with the status by which SkillExecutionMaster recognises a cancellation."""
        return finish if finish.success else replace(finish, status="CANCELLED", progress=0.0)

    def intended_arguments(self, key: ActionKey) -> tuple[str, ...]:
        """Return the arguments; SkillExecutionMaster sends an empty text for an empty list."""
        return () if key.arguments == ("",) else key.arguments


PROTOCOL = SkillExecutionProtocol()


class SkillExecutionSkills(HubSkills):
    """Executes skills through the executor nodes of ros2-clips-executive."""

    protocol: ClassVar[HubProtocol] = PROTOCOL
