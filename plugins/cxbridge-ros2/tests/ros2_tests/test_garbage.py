"""Garbage from another node on all topics and services of a daemon, and from servers of skills."""

from __future__ import annotations

import random
import re
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.clock import RealClock
from cxbridge.daemon.options import DaemonOptions
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.interfaces.definitions import ACTION_DEFINITIONS
from cxbridge_ros2.messages import Codec, Message
from cxbridge_ros2.names import TypeName, parse_type
from cxbridge_ros2.node import RequestHandler, SendResponse
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.transports.dds import DdsNode
from cxbridge_ros2.transports.dds.services import write_data
from ros2_tests.clients import ParameterClient
from ros2_tests.conftest import poll_until, wait_until
from ros2_tests.hub import Side
from ros2_tests.peer import PACKAGES
from ros2_tests.random_messages import MessageGenerator
from ros2_tests.test_managed import wait_for_answer
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
fawkes: {{mainapp: {{desired_loop_time: 4000}}}}  # the loop reads data before ten items are queued
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


@pytest.mark.parametrize("seed", range(2))
def test_daemon_survives_garbage_on_topics_and_services(domain: int, tmp_path: Path, seed: int):
    enemy_domain = domain + 14
    (tmp_path / "talk.py").write_text(TALK)
    file = tmp_path / "daemon.yaml"
    file.write_text(DAEMON.format(domain=enemy_domain))
    types = Definitions(environment={}, texts=ACTION_DEFINITIONS)
    generator = MessageGenerator(types, random.Random(seed))
    with (
        running(DaemonOptions(config=file)) as (daemon, lines, outcome),
        DdsNode("enemy", types, enemy_domain, report=lambda _text: None) as node,
    ):
        poll_until(node, lambda: len(node._discovery._discovered_endpoints[False]) > 20)
        poll_until(node, lambda: not node.poll(0.5))
        node._discovery.update()
        topics = {
            each.topic_name: each.type_name for each in node._discovery._discovered_endpoints[False].values()
        }
        assert {"rt/tf", "rt/pose", "rt/actions_hub", "rt/skill_board", "rq/victim/change_stateRequest"} <= {
            *topics
        }
        for topic, kind in sorted(topics.items()):
            match = _DDS_TYPE.fullmatch(kind)
            if match is None or topic == "ros_discovery_info" or "change_state" in topic:
                continue  # a transition may end the daemon, which is correct
            name = TypeName(match[1], match[2], match[3])
            writer = node._open_writer(topic, name, PROFILES["tf_static" if "static" in topic else "default"])
            head = b"" if topic.startswith("rt/") else generator.random.randbytes(8) + bytes(8)
            for _ in range(ROUNDS):
                data = generator.make_data(name)
                write_data(writer, data[:4] + head + data[4:])
                node.poll(0.004)
        loops = daemon.loop.cycle_count
        poll_until(node, lambda: outcome or daemon.loop.cycle_count > loops + 30)
        assert not outcome, "\n".join(lines)
        client = ParameterClient(node, "/victim")
        poll_until(node, lambda: client.has_server)
        assert wait_for_answer(node, lambda done: client.get(["spec"], done)) is not None
        assert not outcome
        assert not [line for line in lines if "Traceback" in line or _ERROR.search(line)], lines
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


def test_skills_survive_random_responses_of_servers(domain: int):
    """Skills end in spite of random responses of an action and a service, and failures have a reason."""
    types = Definitions([PACKAGES], environment={})
    generator, action = MessageGenerator(types, random.Random(1)), "example_interfaces/action/Fibonacci"
    kind, clock = parse_type(action, "action"), RealClock()
    with DdsNode("enemy", types, domain + 15, report=lambda _text: None) as node:

        def make_handler(name: TypeName) -> RequestHandler:
            def respond(_request: Message, reply: SendResponse) -> None:
                if generator.random.random() < 0.8:
                    reply(generator.make_message(name.derive("Response")))

            return respond

        feedback = node.create_publisher("/goto/_action/feedback", f"{action}_FeedbackMessage")
        status = node.create_publisher(
            "/goto/_action/status", "action_msgs/msg/GoalStatusArray", PROFILES["action_status"]
        )
        goals: list[bytes] = []

        def accept(request: Message, reply: SendResponse) -> None:
            goals.append(request["goal_id"]["uuid"])
            reply({**generator.make_message(kind.derive("SendGoal").derive("Response")), "accepted": True})

        node.serve_later("/goto/_action/send_goal", f"{action}_SendGoal", accept)
        node.serve_later(
            "/goto/_action/get_result", f"{action}_GetResult", make_handler(kind.derive("GetResult"))
        )
        cancel = "action_msgs/srv/CancelGoal"
        node.serve_later("/goto/_action/cancel_goal", cancel, make_handler(parse_type(cancel, "srv")))
        beep = "std_srvs/srv/Trigger"
        node.serve_later("/beep", beep, make_handler(parse_type(beep, "srv")))
        side = Side(SKILLS.replace("DOMAIN", str(domain + 15)).replace("PACKAGES", str(PACKAGES)), clock)
        ends = []
        for number in range(24):
            master = side.request_skill("goto" if number % 3 else "beep")
            limit_s = time.monotonic() + 20
            while not master.is_over:
                side.loop()
                node.poll(0.002)
                for each in goals:
                    goal_id = {"goal_id": {"uuid": each}}
                    code = generator.random.randrange(-128, 128)
                    status.publish({"status_list": [{"goal_info": goal_id, "status": code}]})
                    feedback.publish({**generator.make_message(kind.derive("FeedbackMessage")), **goal_id})
                assert time.monotonic() < limit_s, side.lines
            goals.clear()
            ends.append((str(master.state), master.error))
        side.close()
    assert {state for state, _ in ends} <= {"SUCCEEDED", "FAILED"}, ends
    assert all(error for state, error in ends if state == "FAILED"), ends
    assert not [each for each in ends if _ERROR.search(each[1])], ends
    assert not [line for line in side.lines if _ERROR.search(line)], side.lines


class BrokenCodec(Codec):
    """A codec that truncates responses."""

    def encode(self, name: TypeName, message: Mapping[str, Any]) -> bytes:
        data = super().encode(name, message)
        return data[:5] if str(name).endswith("_Response") else data


@pytest.mark.parametrize("has_error_callback", [True, False])
def test_broken_response_is_reported_without_ending_loop(domain: int, has_error_callback: bool):
    types, trigger = Definitions([PACKAGES], environment={}), "std_srvs/srv/Trigger"
    reports: list[str] = []
    reasons: list[str] = []
    got: list[Message] = []
    with (
        DdsNode("enemy", types, domain + 16, report=reports.append) as node,
        DdsNode("victim", types, domain + 16, report=reports.append) as victim,
    ):
        node._codec = BrokenCodec(types)
        node.serve("/beep", trigger, lambda _request: {"success": True, "message": "beep"})
        client = victim.create_client("/beep", trigger)
        polls = partial(node.poll, 0.01), partial(victim.poll, 0.01)
        wait_until(lambda: client.server_numbers, *polls)
        client.call({}, got.append, reasons.append if has_error_callback else None)
        wait_until(lambda: reports, *polls)
        victim.poll(0.1)
    assert reports[0].startswith("/beep: "), reports
    assert reasons == ["the response is broken"] * has_error_callback
    assert got == []
