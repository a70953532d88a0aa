"""A server of an action vanishes in each state of a goal, with or without a restart."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.clock import RealClock
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import SendResponse
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.transports.dds import DdsNode
from ros2_tests.conftest import wait_until
from ros2_tests.hub import Side
from ros2_tests.peer import PACKAGES
from tests.support import share

ACTION = "example_interfaces/action/Fibonacci"
STATES = ("before response", "after acceptance", "during execution", "during cancellation")

SKILLS = f"""
skill-board:
  agents:
    robot1:
      executors:
        ros:
          class: cxbridge_ros2.skills:RosSkills
          domain: DOMAIN
          packages: [{PACKAGES}]
          skills:
            count: {{action: {ACTION}, name: /count, goal: {{order: 3}}, patience: 1, timeout: 20}}
"""


class Server:
    """A server of an action that stops to answer in a given state."""

    def __init__(self, domain: int, state: str) -> None:
        self.node = DdsNode("server", Definitions([PACKAGES], environment={}), domain)
        self.is_reached = False
        self._state = state
        self._goal: bytes = b""
        self.feedback = self.node.create_publisher("/count/_action/feedback", f"{ACTION}_FeedbackMessage")
        self.node.create_publisher(
            "/count/_action/status", "action_msgs/msg/GoalStatusArray", PROFILES["action_status"]
        )
        services: Mapping[str, tuple[str, Callable[[Message, SendResponse], None]]] = {
            "send_goal": (f"{ACTION}_SendGoal", self._accept),
            "get_result": (f"{ACTION}_GetResult", self._result),
            "cancel_goal": ("action_msgs/srv/CancelGoal", self._cancel),
        }
        for name, (kind, answer) in services.items():
            self.node.serve_later(f"/count/_action/{name}", kind, answer)

    def _accept(self, request: Message, reply: SendResponse) -> None:
        self._goal = request["goal_id"]["uuid"]
        if self._state == STATES[0]:
            self.is_reached = True
        else:
            reply({"accepted": True})

    def _result(self, request: Message, reply: SendResponse) -> None:
        if request["goal_id"]["uuid"] == self._goal:
            self.is_reached = self._state != STATES[3]
        else:  # a goal of the previous server
            reply({"status": 0})

    def _cancel(self, _request: Message, _reply: SendResponse) -> None:
        self.is_reached = True

    def loop(self) -> None:
        self.node.poll(0.01)
        if self._goal and self._state == STATES[2]:
            self.feedback.publish({"goal_id": {"uuid": self._goal}, "feedback": {"sequence": [0, 1]}})


@pytest.fixture
def side(domain: int) -> Iterator[Side]:
    side = Side(SKILLS.replace("DOMAIN", str(domain + 17)), RealClock())
    yield side
    side.close()


@pytest.mark.parametrize("comes_back", [False, True], ids=["gone", "restarted"])
@pytest.mark.parametrize("state", share(STATES, 2))
def test_skill_ends_after_server_vanishes(side: Side, domain: int, state: str, comes_back: bool):
    server = Server(domain + 17, state)
    master = side.request_skill("count")
    if state == STATES[3]:
        wait_until(lambda: server._goal, side.loop, server.loop)
        wait_until(lambda: not server.node.poll(0.2), side.loop)
        side.service.local_calls.cancel(master.number)
    wait_until(lambda: server.is_reached, side.loop, server.loop)
    server.node.close()
    second_server = Server(domain + 17, state) if comes_back else None
    wait_until(lambda: master.is_over, side.loop, *([second_server.loop] if second_server else []))
    assert str(master.state) != "SUCCEEDED"
    assert "/count" in master.error or state == STATES[3], master.error
    if second_server is not None:
        second_server.node.close()
    assert not [line for line in side.lines if "Error" in line]
