"""Another node sends garbage on all topics and services of a daemon; the daemon lives, and logs it."""

from __future__ import annotations

import math
import random
import re
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from rosbags.interfaces import Nodetype

from cxbridge.clock import RealClock
from cxbridge.daemon.options import DaemonOptions
from cxbridge_ros2.definitions import Definitions, FieldType
from cxbridge_ros2.interfaces.definitions import ACTION_DEFINITIONS
from cxbridge_ros2.messages import Codec, Message
from cxbridge_ros2.names import TypeName, parse_type
from cxbridge_ros2.node import RequestHandler, SendResponse
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.transports.dds import DdsNode
from cxbridge_ros2.transports.dds.services import write_data
from ros2_tests.clients import ParameterClient
from ros2_tests.conftest import poll_until, until
from ros2_tests.hub import Side
from ros2_tests.peer import PACKAGES
from ros2_tests.test_managed import answer
from tests.daemon.test_daemon import running

TALK = """
from cxbridge.skiller.board import SkillExecutor


class Talk(SkillExecutor):
    skills = ("move", "say")

    def execute(self, call):
        yield 0.5
"""

DAEMON = """
cxbridge: {{fawkes: {{enable: false}}, zmq: {{endpoints: []}}}}
fawkes: {{mainapp: {{desired_loop_time: 4000}}}}  # it takes what comes before more than ten have come
skill-board:
  agents:
    robot1:
      executors:
        talk: {{class: "talk.py:Talk"}}
ros2:
  node: {{name: victim, domain: {domain}}}
  performers:
    plansys2: {{protocol: plansys2, domain: {domain}, actions: [move]}}
    thesis: {{protocol: skill-execution, domain: {domain}, actions: [say]}}
  tf: {{frames: all, domain: {domain}}}
  skiller: {{action: /execute, domain: {domain}}}
  interfaces:
    pose:
      interface: Position3DInterface::Pose
      direction: write
      topic: /pose
      type: geometry_msgs/msg/PoseStamped
      fields: {{frame: header.frame_id}}
      domain: {domain}
"""

ROUNDS = 12
_ERROR = re.compile(r"\b[A-Z]\w*(Error|Exception)\b")
_DDS_TYPE = re.compile(r"(\w+)::(msg|srv|action)::dds_::(\w+)_")
_TEXTS = ("", "x", "a b", "é" * 40, "/", "\\", '"', "()", "$x", "%s{}", "move", "say", "victim", "robot1")
_NUMBERS = (0, 1, -1, 2, 3, 4, 5, 6, 7, 127, -128, 255, 2**31 - 1, -(2**31), 2**63 - 1)
_FLOATS = (0.0, -0.0, 1.0, -1e308, 1e308, float("nan"), float("inf"), float("-inf"))


class Enemy:
    """Draws messages of any type."""

    def __init__(self, types: Definitions, seed: int) -> None:
        self.random, self._types, self._codec = random.Random(seed), types, Codec(types)

    def message(self, name: TypeName) -> Mapping[str, Any]:
        fields = self._types.find_fields(name)
        return {field: self._value(kind) for field, kind in fields if not field.startswith("structure_needs")}

    def _value(self, kind: FieldType) -> Any:
        node, rest = kind
        if node == Nodetype.NAME:
            return self.message(parse_type(rest))
        if node == Nodetype.BASE:
            return self._base(*rest)
        of, count = rest
        size = count if node == Nodetype.ARRAY else self.random.randrange(min(count or 4, 4))
        if of[0] == Nodetype.BASE and of[1][0] in ("uint8", "byte"):
            return self.random.randbytes(size)
        return [self._value(of) for _ in range(size)]

    def _base(self, name: str, bound: int) -> Any:
        if name == "bool":
            return self.random.random() < 0.5
        if name == "string":
            return self.random.choice(_TEXTS)[: bound or None]
        if name.startswith("float"):
            value = self.random.choice(_FLOATS)
            return value if name == "float64" or math.isinf(value) or not abs(value) > 2 else 0.5
        bits = int(name.removeprefix("u").removeprefix("int")) if name != "byte" else 8
        low, high = (0, 2**bits - 1) if name[0] in "ub" else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        return self.random.choice([each for each in _NUMBERS if low <= each <= high])

    def data(self, name: TypeName) -> bytes:
        """Return a message, or bytes that were one, or never."""
        made = self._codec.encode(name, self.message(name))
        what = self.random.randrange(5)
        if what == 0:
            return made[: self.random.randrange(5, len(made) + 1)]  # the wheel sends no empty ones
        if what == 1:
            place = self.random.randrange(4, max(5, len(made)))
            return made[:place] + self.random.randbytes(3) + made[place + 3 :]
        return b"\0\1\0\0" + self.random.randbytes(self.random.randrange(1, 80)) if what == 2 else made


@pytest.mark.parametrize("seed", range(2))
def test_a_daemon_survives_what_others_send(domain: int, tmp_path: Path, seed: int):
    where = domain + 14
    (tmp_path / "talk.py").write_text(TALK)
    file = tmp_path / "daemon.yaml"
    file.write_text(DAEMON.format(domain=where))
    types = Definitions(environment={}, texts=ACTION_DEFINITIONS)
    enemy = Enemy(types, seed)
    with (
        running(DaemonOptions(config=file)) as (daemon, lines, outcome),
        DdsNode("enemy", types, where, report=lambda _text: None) as node,
    ):
        poll_until(node, lambda: len(node._discovery._discovered_endpoints[False]) > 20)
        poll_until(node, lambda: not node.poll(0.5))
        node._discovery.update()
        read = {
            each.topic_name: each.type_name for each in node._discovery._discovered_endpoints[False].values()
        }
        assert {"rt/tf", "rt/pose", "rt/actions_hub", "rt/skill_board", "rq/victim/change_stateRequest"} <= {
            *read
        }
        for topic, kind in sorted(read.items()):
            found = _DDS_TYPE.fullmatch(kind)
            if found is None or topic == "ros_discovery_info" or "change_state" in topic:
                continue  # with change_state anybody may end it: that is no mistake
            name = TypeName(found[1], found[2], found[3])
            writer = node._open_writer(topic, name, PROFILES["tf_static" if "static" in topic else "default"])
            head = b"" if topic.startswith("rt/") else enemy.random.randbytes(8) + bytes(8)
            for _ in range(ROUNDS):
                data = enemy.data(name)
                write_data(writer, data[:4] + head + data[4:])
                node.poll(0.004)
        loops = daemon.loop.cycle_count
        poll_until(node, lambda: outcome or daemon.loop.cycle_count > loops + 30)
        assert not outcome, "\n".join(lines)
        client = ParameterClient(node, "/victim")
        poll_until(node, lambda: client.has_server)
        assert answer(node, lambda done: client.get(["spec"], done)) is not None
        assert not outcome
        said = "\n".join(lines)
        assert "Traceback" not in said
        assert not [line for line in lines if _ERROR.search(line)], said
        assert len(lines) < 400


SKILLS = """
skill-board:
  agents:
    robot1:
      executors:
        ros:
          class: cxbridge_ros2.skills:RosSkills
          domain: DOMAIN
          packages: [PACKAGES]
          skills:
            goto:
              {action: example_interfaces/action/Fibonacci, name: /goto, feedback: sequence, timeout: 2}
            beep: {service: std_srvs/srv/Trigger, name: /beep, success: success, error: message, timeout: 2}
"""


def test_skills_survive_what_servers_answer(domain: int):
    """All answers of an action and a service are drawn: each skill ends, with a reason when it fails."""
    types = Definitions([PACKAGES], environment={})
    enemy, action = Enemy(types, 1), "example_interfaces/action/Fibonacci"
    kind, clock = parse_type(action, "action"), RealClock()
    with DdsNode("enemy", types, domain + 15, report=lambda _text: None) as node:

        def answers(name: TypeName) -> RequestHandler:
            def answer(_request: Message, reply: SendResponse) -> None:
                if enemy.random.random() < 0.8:
                    reply(enemy.message(name.derive("Response")))

            return answer

        feedback = node.create_publisher("/goto/_action/feedback", f"{action}_FeedbackMessage")
        status = node.create_publisher(
            "/goto/_action/status", "action_msgs/msg/GoalStatusArray", PROFILES["action_status"]
        )
        goals: list[bytes] = []

        def accept(request: Message, reply: SendResponse) -> None:
            goals.append(request["goal_id"]["uuid"])
            reply({**enemy.message(kind.derive("SendGoal").derive("Response")), "accepted": True})

        node.serve_later("/goto/_action/send_goal", f"{action}_SendGoal", accept)
        node.serve_later("/goto/_action/get_result", f"{action}_GetResult", answers(kind.derive("GetResult")))
        cancel = "action_msgs/srv/CancelGoal"
        node.serve_later("/goto/_action/cancel_goal", cancel, answers(parse_type(cancel, "srv")))
        beep = "std_srvs/srv/Trigger"
        node.serve_later("/beep", beep, answers(parse_type(beep, "srv")))
        side = Side(SKILLS.replace("DOMAIN", str(domain + 15)).replace("PACKAGES", str(PACKAGES)), clock)
        ends = []
        for number in range(24):
            master = side.ask("goto" if number % 3 else "beep")
            until_s = time.monotonic() + 20
            while not master.is_over:
                side.loop()
                node.poll(0.002)
                for each in goals:
                    state = {
                        "goal_info": {"goal_id": {"uuid": each}},
                        "status": enemy.random.randrange(-128, 128),
                    }
                    status.publish({"status_list": [state]})
                    drawn = dict(enemy.message(kind.derive("FeedbackMessage")))
                    feedback.publish({**drawn, "goal_id": {"uuid": each}})
                assert time.monotonic() < until_s, side.lines
            goals.clear()
            ends.append((str(master.state), master.error))
        side.close()
    assert {state for state, _ in ends} <= {"SUCCEEDED", "FAILED"}, ends
    assert all(error for state, error in ends if state == "FAILED"), ends
    assert not [each for each in ends if _ERROR.search(each[1])], ends
    assert not [line for line in side.lines if _ERROR.search(line)], side.lines


class BrokenCodec(Codec):
    """Cuts off the responses that it makes."""

    def encode(self, name: TypeName, message: Mapping[str, Any]) -> bytes:
        made = super().encode(name, message)
        return made[:5] if str(name).endswith("_Response") else made


@pytest.mark.parametrize("cares", [True, False])
def test_a_broken_response_is_reported_and_ends_no_loop(domain: int, cares: bool):
    types, trigger = Definitions([PACKAGES], environment={}), "std_srvs/srv/Trigger"
    told: list[str] = []
    lost: list[str] = []
    got: list[Message] = []
    with (
        DdsNode("enemy", types, domain + 16, report=told.append) as node,
        DdsNode("victim", types, domain + 16, report=told.append) as victim,
    ):
        node._codec = BrokenCodec(types)
        node.serve("/beep", trigger, lambda _request: {"success": True, "message": "beep"})
        client = victim.create_client("/beep", trigger)
        polls = partial(node.poll, 0.01), partial(victim.poll, 0.01)
        until(lambda: client.server_numbers, *polls)
        client.call({}, got.append, lost.append if cares else None)
        until(lambda: told, *polls)
        victim.poll(0.1)
    assert told[0].startswith("/beep: "), told
    assert lost == ["the response is broken"] * cares
    assert got == []
