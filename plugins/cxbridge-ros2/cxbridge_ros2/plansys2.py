"""The protocol of PlanSys2's hub, for callers and performers (docs/ros2.md).

The hub is the topic ``/actions_hub``, on which callers find performers for actions. In PlanSys2, the caller
is the class ActionExecutor and the performer is ActionExecutorClient. The protocol has not changed since
ROS 2 Foxy.
"""

from __future__ import annotations

from typing import ClassVar, Final

from cxbridge_ros2.hub.caller import HubSkills
from cxbridge_ros2.hub.protocol import HubProtocol

PROTOCOL: Final = HubProtocol(
    name="plansys2",
    topic="/actions_hub",
    message_type="plansys2_msgs/msg/ActionExecution",
    heartbeat_topic="/performers_status",
    heartbeat_type="plansys2_msgs/msg/ActionPerformerStatus",
    arguments_field="arguments",
    progress_field="completion",
    heartbeat_action_field="action",
    # ActionExecutor repeats a REQUEST after 1 s, and gives up after 30 s
    server_timeout_s=30.0,
    request_lifetime_s=1.0,
    cancelled_status=None,  # ActionExecutorClient stops silently, and ActionExecutor expects no message
    empty_argument=None,
    has_skill_strings=False,
    has_heartbeat_stamps=True,
)


class PlanSys2Skills(HubSkills):
    """Executes skills through action performers of PlanSys2."""

    protocol: ClassVar[HubProtocol] = PROTOCOL
