"""The protocol of PlanSys2's hub, for both sides (docs/ros2.md).

Its original caller is ActionExecutor, its original performer ActionExecutorClient. The protocol has not
changed since ROS 2 Foxy.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from cxbridge.clock import MICROSECONDS
from cxbridge_ros2.hub.caller import HubSkills
from cxbridge_ros2.hub.words import HubProtocol, Key, Sign, Word
from cxbridge_ros2.messages import Message

_NANOSECONDS = 1000  # per microsecond


class PlanSys2Protocol(HubProtocol):
    """Messages as plansys2_msgs/msg/ActionExecution."""

    name = "plansys2"
    topic = "/actions_hub"
    message_type = "plansys2_msgs/msg/ActionExecution"
    signs_topic = "/performers_status"
    signs_type = "plansys2_msgs/msg/ActionPerformerStatus"
    patience_s = 30.0
    wanted_s = 1.0

    def message(self, word: Word) -> Mapping[str, Any]:
        return {
            "type": word.kind,
            "node_id": word.node,
            "action": word.key.action,
            "arguments": list(word.key.arguments),
            "success": word.success,
            "completion": word.progress,
            "status": word.status,
        }

    def word(self, message: Message) -> Word:
        return Word(
            kind=message["type"],
            node=message["node_id"],
            key=Key(message["action"], tuple(message["arguments"]), ""),
            success=message["success"],
            progress=message["completion"],
            status=message["status"],
        )

    def sign_message(self, sign: Sign, now_us: int) -> Mapping[str, Any]:
        seconds, rest = divmod(now_us, MICROSECONDS)
        return {
            "status_stamp": {"sec": seconds, "nanosec": rest * _NANOSECONDS},
            "state": sign.life,
            "action": sign.action,
            "node_name": sign.node,
        }

    def sign(self, message: Message) -> Sign:
        return Sign(message["node_name"], message["action"], message["state"])

    def after_cancel(self, finish: Word) -> Word | None:  # noqa: ARG002
        """Return None: PlanSys2's performers stop silently, and its executor expects no message."""
        return None

    def arguments_of(self, key: Key) -> tuple[str, ...]:
        """Return the arguments; PlanSys2's executor sends the action's name in place of no argument."""
        return () if key.arguments == (key.action,) else key.arguments


PROTOCOL = PlanSys2Protocol()


class PlanSys2Skills(HubSkills):
    """Executes skills through action performers of PlanSys2."""

    protocol: ClassVar[HubProtocol] = PROTOCOL
