"""The table of rights: a node on the domain tries each operation of ROS 2 with each setting."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import RealClock
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.errors import CxbridgeError
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.rights import EXEC_SKILL, FRAME_RIGHTS, Right, right_of_frame
from cxbridge_ros2.actions import ActionClient, CancelCode
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.experts.client import ExpertClient
from cxbridge_ros2.experts.definitions import TYPE_DEFINITIONS
from cxbridge_ros2.frames import TF_MESSAGE_TYPE
from cxbridge_ros2.hub.protocol import ActionKey, HubMessage, MessageKind
from cxbridge_ros2.interfaces.definitions import (
    ACTION_DEFINITIONS,
    generate_definitions,
    make_ros_message_type,
)
from cxbridge_ros2.interfaces.definitions import EXEC_SKILL_TYPE as EXEC_SKILL_ACTION
from cxbridge_ros2.plansys2 import PROTOCOL
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.transports.dds import DdsNode
from ros2_tests.conftest import poll_until
from ros2_tests.experts.agents import AGENT, FAST
from ros2_tests.experts.test_services import make_instance
from tests.daemon.test_daemon import running
from tests.support import share

CONFIG = """
cxbridge:
  fawkes: {port: 0}
  zmq: {endpoints: ['ipc://FOLDER/bb'MORE_ENDPOINT], insecure: true}
  SETTINGS
skiller: {mode: fawkes}
skill-board:
  agents: {robot2: {executors: {work: {class: "ros2_tests.hub:Work"}}}}
ros2:
  node: {name: robot, domain: DOMAIN}
  skiller: {domain: DOMAIN}
  tf: {domain: DOMAIN}
  experts: {serve: all, distribution: iron, domain: DOMAIN}
  performers: {hub: {protocol: plansys2, name: ours, agent: robot2, actions: [wave], domain: DOMAIN}}
  interfaces:
    battery: {interface: "BatteryInterface::Robot", direction: write, domain: DOMAIN}
"""

BEYOND = ", 'tcp://0.0.0.0:*'"
SETTINGS: dict[str, tuple[str, str, Right]] = {
    "defaults": ("", "", Right.PROGRAMS),
    "remote-programs off": ("remote-programs: false", "", Right.CONTROL),
    "remote-control off": ("remote-control: false", "", Right.LOOK),
    "beyond the loopback": ("", BEYOND, Right.CONTROL),
    "remote-programs beyond the loopback": ("remote-programs: true", BEYOND, Right.PROGRAMS),
}
"""By name: settings, a further endpoint, and the highest right of clients."""


@dataclass
class Session:
    """A node that uses a daemon, and the log of the daemon."""

    node: DdsNode
    daemon: Daemon
    lines: list[str]
    clients: dict[str, Any] = field(default_factory=dict)

    def wait_until(self, condition: Callable[[], Any]) -> None:
        poll_until(self.node, condition)

    def call(self, service: str, kind: str, request: dict[str, Any] | None = None) -> Any:
        """Call a service, and return the response."""
        client = self.clients.get(service) or self.node.create_client(service, kind)
        self.clients[service] = client
        self.wait_until(lambda: client.has_server)
        got: list[Any] = []
        client.call(request or {}, got.append)
        self.wait_until(lambda: got)
        return got[0]

    def publish(
        self, topic: str, kind: str, message: Any, happened: Callable[[], Any], qos: str = "default"
    ) -> bool:
        """Publish a message, wait for an effect or a logged refusal, and return whether the effect came."""
        publisher = self.node.create_publisher(topic, kind, PROFILES[qos])
        self.wait_until(publisher.count_subscriptions)
        publisher.publish(message)
        refusal = f"refused: {topic}:"
        self.wait_until(lambda: happened() or any(refusal in line for line in self.lines))
        has_happened = bool(happened())
        assert has_happened is not any(refusal in line for line in self.lines)
        publisher.close()
        return has_happened


def _lifecycle(session: Session, frame: str) -> bool:
    kind = f"lifecycle_msgs/srv/{_KINDS.get(frame, ''.join(map(str.capitalize, frame.split('_'))))}"
    if frame != "change_state":
        return any(session.call(f"/robot/{frame}", kind).values())
    successes = [
        session.call(f"/robot/{frame}", kind, {"transition": {"label": label}})["success"]
        for label in ("deactivate", "activate")
    ]
    assert session.daemon.state == "RUNNING"
    return all(successes)


_KINDS = {"get_transition_graph": "GetAvailableTransitions"}


def _parameters(session: Session, frame: str) -> bool:
    kind = f"rcl_interfaces/srv/{''.join(map(str.capitalize, frame.split('_')))}"
    value = {"name": "spec", "value": {"type": 4, "string_value": "other"}}
    request = {"parameters": [value]} if frame.startswith("set") else {"names": ["spec"]}
    if frame == "list_parameters":
        request = {}
    response = session.call(f"/robot/{frame}", kind, request)
    if not frame.startswith("set"):
        return any(response.values())
    (result,) = response.get("results", [response.get("result")])
    assert result["successful"] is False  # the parameter is read-only
    return "refused" not in result["reason"]


def _cancel(session: Session) -> bool:
    request = {"goal_info": {"goal_id": {"uuid": bytes(15) + b"\1"}}}
    code = session.call("/skiller/execute/_action/cancel_goal", "action_msgs/srv/CancelGoal", request)
    return bool(code["return_code"] == CancelCode.UNKNOWN_GOAL_ID)


def _get_result(session: Session) -> bool:
    kind = EXEC_SKILL_ACTION + "_GetResult"
    request = {"goal_id": {"uuid": bytes(15) + b"\1"}}
    return bool(session.call("/skiller/execute/_action/get_result", kind, request)["status"] == 0)


def _execute(session: Session) -> bool:
    with ActionClient(session.node, "/skiller/execute", EXEC_SKILL_ACTION) as client:
        session.wait_until(lambda: client.has_server)
        sent = client.send({"skill_string": 'error("evaluated " .. 1 + 1)', "steal": True})
        session.wait_until(lambda: sent.is_over)
        evaluated = "evaluated 2" in str(sent.result)
        assert evaluated is bool(sent.is_accepted)
        return evaluated


def _write(session: Session) -> bool:
    battery = session.daemon.board.open_for_reading("BatteryInterface", "Robot")

    def is_written() -> bool:
        battery.read()
        return int(battery.get("current")) == 7

    topic = "/blackboard/BatteryInterface/Robot"
    return session.publish(topic, make_ros_message_type("BatteryInterface"), {"current": 7}, is_written)


def _transforms(session: Session, topic: str) -> bool:
    frame = f"of{topic.replace('/', '_')}"
    transform = {
        "header": {"frame_id": "map"},
        "child_frame_id": frame,
        "transform": {"rotation": {"w": 1.0}},
    }
    is_written = partial(session.daemon.board.list, "TransformInterface", f"*{frame}")
    return session.publish(topic, TF_MESSAGE_TYPE, {"transforms": [transform]}, is_written, topic[1:])


def _send_hub_message(session: Session) -> bool:
    protocol = PROTOCOL
    kinds: list[int] = []
    end = session.node.subscribe(
        protocol.topic, protocol.message_type, lambda each: kinds.append(each["type"])
    )
    message = HubMessage(MessageKind.REQUEST, "asks", ActionKey("wave", ("a",)))
    is_answered = session.publish(
        protocol.topic, protocol.message_type, protocol.encode(message), lambda: MessageKind.RESPONSE in kinds
    )
    end()
    return is_answered


def _expert(session: Session, frame: str) -> bool:
    client = ExpertClient(session.node, RealClock(), "", server_timeout_s=20.0)
    if frame == "read":
        return bool(client.call("/problem_expert/get_problem")["success"])
    if frame == "change":
        response = client.call("/problem_expert/add_problem_instance", make_instance("attic", "room"))
        assert response["success"] is ("attic" in client.request("/problem_expert/get_problem")["problem"])
        return bool(response["success"])
    return not client.call("/planner/get_plan")["error_info"].startswith("refused")


PROBES: dict[tuple[str, str], Callable[[Session], bool]] = {
    **{
        (name, each): partial(_lifecycle, frame=each)
        for name in ["ros2-lifecycle"]
        for each in FRAME_RIGHTS[name]
    },
    **{
        (name, each): partial(_parameters, frame=each)
        for name in ["ros2-parameters"]
        for each in FRAME_RIGHTS[name]
    },
    ("ros2-action", "cancel_goal"): _cancel,
    ("ros2-action", "get_result"): _get_result,
    ("ros2-interfaces", "write"): _write,
    ("ros2-tf", "/tf"): partial(_transforms, topic="/tf"),
    ("ros2-tf", "/tf_static"): partial(_transforms, topic="/tf_static"),
    ("ros2-performers", "word"): _send_hub_message,
    **{("ros2-experts", each): partial(_expert, frame=each) for each in ("read", "change", "plan")},
}
"""The probe of each row of the table, which returns whether the operation was done."""


def test_each_ros_row_of_table_has_probe():
    rows = {
        (name, frame) for name, frames in FRAME_RIGHTS.items() if name.startswith("ros2-") for frame in frames
    }
    assert rows == set(PROBES)


@contextmanager
def open_session(folder: Path, domain: int, settings: str, endpoint: str) -> Iterator[Session]:
    text = next(AGENT.glob("*.yaml")).read_text().replace("clips-dirs: []", f"clips-dirs: ['{AGENT}']")
    text += FAST + CONFIG.replace("FOLDER", str(folder)).replace("DOMAIN", str(domain + 4))
    text = text.replace("MORE_ENDPOINT", endpoint).replace("SETTINGS", settings)
    file = folder / "daemon.yaml"
    file.write_text(text)
    texts = {**ACTION_DEFINITIONS, **TYPE_DEFINITIONS}
    texts |= generate_definitions([InterfaceRegistry().schema("BatteryInterface")])
    types = Definitions(distribution="iron", environment={}, texts=texts)
    with (
        running(DaemonOptions(config=file)) as (daemon, lines, _),
        DdsNode("asks", types, domain + 4) as node,
    ):
        yield Session(node, daemon, lines)


@pytest.mark.parametrize("name", share(SETTINGS, 2))
def test_each_operation_follows_table_of_rights(name: str, domain: int, tmp_path: Path):
    settings, endpoint, highest = SETTINGS[name]
    with open_session(tmp_path, domain, settings, endpoint) as session:
        for (protocol, frame), probe in PROBES.items():
            allowed = right_of_frame(protocol, frame) <= highest
            assert (protocol, frame, probe(session)) == (protocol, frame, allowed)
        skill_right = session.daemon.settings.rights.message_right(*EXEC_SKILL)
        assert skill_right is Right.PROGRAMS
        assert _execute(session) is (highest is Right.PROGRAMS)
        check_skill_strings(session, highest, tmp_path)


def check_skill_strings(session: Session, highest: Right, folder: Path) -> None:
    """Check that skill strings over ZeroMQ and Fawkes' port need the right to run programs."""
    from cxbridge_fawkes.network.messages import blackboard as bb
    from fawkes_tests.network.raw import RawClient

    is_allowed = highest is Right.PROGRAMS
    registry = InterfaceRegistry()
    with ExitStack() as stack:
        board = stack.enter_context(open_blackboard(f"ipc://{folder}/bb", registry, RealClock()))
        skiller = stack.enter_context(board.open_for_reading("SkillerInterface", "Skiller"))
        message = skiller.create_message("ExecSkillMessage")
        message.set("skill_string", "print(1)")
        with nullcontext() if is_allowed else pytest.raises(CxbridgeError, match="refused"):
            skiller.msgq_enqueue(message)
        port = int(
            next(url for url in session.daemon.endpoints if url.startswith("fawkes")).rpartition(":")[2]
        )
        client = stack.enter_context(RawClient(port))
        of_skiller = registry.get("SkillerInterface")
        opened = client.ask(bb.Open("SkillerInterface", "Skiller", of_skiller.SCHEMA.hash, writing=False))
        assert isinstance(opened, bb.OpenSuccess)
        message = of_skiller.MESSAGES["ExecSkillMessage"]()
        sent_to = bb.WireMessage(opened.serial, opened.serial, "ExecSkillMessage", 1, 0, message.to_bytes())
        client.send(sent_to.to_bytes())
        refusal = "ExecSkillMessage to SkillerInterface"
        client.ask(bb.Open("SkillerInterface", "Skiller", of_skiller.SCHEMA.hash, writing=False))
        assert any(refusal in line for line in session.lines) is not is_allowed
