"""The protocol of the thesis' skill board, for both sides (docs/evidence/ros2cx.md).

Its original caller is SkillExecutionMaster, its original performer SkillExecution. It extends PlanSys2's
protocol by an agent and by the mapped skill string.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from msgspec.structs import replace

from cxbridge_ros2.hub.caller import HubSkills
from cxbridge_ros2.hub.words import HubProtocol, Key, Sign, Word
from cxbridge_ros2.messages import Message


class SkillExecutionProtocol(HubProtocol):
    """Messages as cx_msgs/msg/SkillExecution."""

    name = "skill-execution"
    topic = "/skill_board"
    message_type = "cx_msgs/msg/SkillExecution"
    signs_topic = "/skill_executioner_status"
    signs_type = "cx_msgs/msg/SkillExecutionerInformation"
    patience_s = 4.0
    wanted_s = 4.0
    has_agents = True

    def message(self, word: Word) -> Mapping[str, Any]:
        return {
            "type": word.kind,
            "node_id": word.node,
            "action": word.key.action,
            "action_parameters": list(word.key.arguments),
            "agent_id": word.key.agent,
            "mapped_action": word.mapped,
            "status": word.status,
            "success": word.success,
            "progress": word.progress,
        }

    def word(self, message: Message) -> Word:
        return Word(
            kind=message["type"],
            node=message["node_id"],
            key=Key(message["action"], tuple(message["action_parameters"]), message["agent_id"]),
            mapped=message["mapped_action"],
            success=message["success"],
            progress=message["progress"],
            status=message["status"],
        )

    def sign_message(self, sign: Sign, now_us: int) -> Mapping[str, Any]:  # noqa: ARG002 - the message has no stamp
        return {"state": sign.life, "action_name": sign.action, "node_name": sign.node}

    def sign(self, message: Message) -> Sign:
        return Sign(message["node_name"], message["action_name"], message["state"])

    def after_cancel(self, finish: Word) -> Word | None:
        """Return a FINISH with the status by which the original caller recognises a cancellation."""
        return finish if finish.success else replace(finish, status="CANCELLED", progress=0.0)

    def arguments_of(self, key: Key) -> tuple[str, ...]:
        """Return the arguments; the original caller sends an empty text in place of no argument."""
        return () if key.arguments == ("",) else key.arguments


PROTOCOL = SkillExecutionProtocol()


class SkillExecutionSkills(HubSkills):
    """Executes skills through executor nodes of the thesis."""

    protocol: ClassVar[HubProtocol] = PROTOCOL
