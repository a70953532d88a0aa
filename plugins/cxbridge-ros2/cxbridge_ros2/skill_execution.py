"""The protocol of the skill board of ros2-clips-executive, for callers and performers.

ros2-clips-executive (fawkesrobotics, 2021) is the executive of a thesis; see docs/evidence/ros2cx.md. The
caller is its class SkillExecutionMaster, the performer its class SkillExecution. The protocol extends that of
PlanSys2 by a skill string, and by the name of a robot, which the rules of the thesis leave empty.
"""

from __future__ import annotations

from typing import ClassVar, Final

from cxbridge_ros2.hub.caller import HubSkills
from cxbridge_ros2.hub.protocol import HubProtocol

PROTOCOL: Final = HubProtocol(
    name="skill-execution",
    topic="/skill_board",
    message_type="cx_msgs/msg/SkillExecution",
    heartbeat_topic="/skill_executioner_status",
    heartbeat_type="cx_msgs/msg/SkillExecutionerInformation",
    arguments_field="action_parameters",
    progress_field="progress",
    heartbeat_action_field="action_name",
    # SkillExecutionMaster never repeats a REQUEST, and gives up after 4 s
    server_timeout_s=4.0,
    request_lifetime_s=4.0,
    cancelled_status="CANCELLED",  # by this status, SkillExecutionMaster recognises a cancellation
    empty_argument="",
    has_skill_strings=True,
    has_heartbeat_stamps=False,
)


class SkillExecutionSkills(HubSkills):
    """Executes skills through the executor nodes of ros2-clips-executive."""

    protocol: ClassVar[HubProtocol] = PROTOCOL
