"""The skill execution of the thesis: its executor nodes execute our skills, ours its executive's.

The protocol is that of its SkillExecutionMaster, which asks, and SkillExecution, which executes: PlanSys2's,
with an agent, and with the skill string that an action is mapped to (docs/evidence/ros2cx.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from msgspec.structs import replace

from cxbridge_ros2.hub.caller import HubSkills
from cxbridge_ros2.hub.words import HubProtocol, Key, Sign, Word
from cxbridge_ros2.messages import Message


class SkillExecutionProtocol(HubProtocol):
    """Words as cx_msgs/msg/SkillExecution."""

    name = "skill-execution"
    topic = "/skill_board"
    message_type = "cx_msgs/msg/SkillExecution"
    signs_topic = "/skill_executioner_status"
    signs_type = "cx_msgs/msg/SkillExecutionerInformation"
    patience_s = 4.0
    wanted_s = 4.0
    has_agents = True

    def message(self, word: Word) -> Mapping[str, Any]:
        """Return the message that says a word."""
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
        """Return the word of a message."""
        return Word(
            kind=message["type"],
            node=message["node_id"],
            key=Key(message["action"], tuple(message["action_parameters"]), message["agent_id"]),
            mapped=message["mapped_action"],
            success=message["success"],
            progress=message["progress"],
            status=message["status"],
        )

    def sign_message(self, sign: Sign, now_us: int) -> Mapping[str, Any]:  # noqa: ARG002  it has no stamp
        """Return the message that is a sign of life."""
        return {"state": sign.life, "action_name": sign.action, "node_name": sign.node}

    def sign(self, message: Message) -> Sign:
        """Return the sign of life that a message is."""
        return Sign(message["node_name"], message["action_name"], message["state"])

    def after_cancel(self, finish: Word) -> Word | None:
        """Return a FINISH with the status by which its master knows that it was cancelled."""
        return finish if finish.success else replace(finish, status="CANCELLED", progress=0.0)

    def arguments_of(self, key: Key) -> tuple[str, ...]:
        """Return the arguments; its master splits a text, and makes an empty one of no text."""
        return () if key.arguments == ("",) else key.arguments


PROTOCOL = SkillExecutionProtocol()


class SkillExecutionSkills(HubSkills):
    """Has executor nodes of the thesis execute skills."""

    protocol: ClassVar[HubProtocol] = PROTOCOL
