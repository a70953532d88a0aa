"""The services, lifecycle and parameters of the node, used by a peer in the same process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cxbridge.mainloop import Hook
from cxbridge.run import run_scenario
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge_ros2cx.cx.node import CxNode
from ros2_tests.clients import ParameterClient
from tests.support import CX_DIR, needs_cx

pytestmark = needs_cx

PARAMETERS = """
/**:
  ros__parameters:
    environments: ["one"]
    one: {plugins: ["executive", "example", "files"], watch: ["facts", "rules"]}
    other: {plugins: ["example"]}
    executive: {plugin: "cx::ExecutivePlugin", publish_on_refresh: true}
    example: {plugin: "cx::ExamplePlugin"}
    files: {plugin: "cx::FileLoadPlugin", load: ["AGENT"]}
"""
AGENT = "(deftemplate thing (slot name)) (defrule hello => (printout t hello crlf) (assert (thing (name a))))"


class Peer:
    """A peer that calls a service in each loop."""

    def __init__(self, folder: Path, *calls):
        agent = folder / "agent.clp"
        agent.write_text(AGENT)
        self.parameters = folder / "params.yaml"
        self.parameters.write_text(PARAMETERS.replace("AGENT", str(agent)))
        self.calls, self.refreshed, self.log = [*calls], 0, folder / "logs"
        self.answers: list[dict[str, object]] = []
        self.values: dict[str, object] = {}
        self.subscription: tuple[str, str, Callable[[dict[str, Any]], None]] | None = None

    def run(self, seconds=3.0):
        options = options_from_keywords(self.parameters, ros2cx=CX_DIR, timeout=seconds, log_dir=self.log)
        result = run_scenario(options, attach=self.attach)
        return result, [line.split("[info] ")[1] for line in (self.log / "one.log").read_text().splitlines()]

    def attach(self, assembly):
        assert isinstance(assembly.executive, CxNode)
        self.node = assembly.executive.manager.context.ros.graph.join("peer")
        self.node.subscribe("/clips_executive/refresh_agenda", "std_msgs/msg/Empty", self.count)
        if self.subscription:
            self.node.subscribe(*self.subscription)
        self.client = ParameterClient(self.node, "/clips_manager")
        assembly.loop.add(Hook.PRE_LOOP, self.step)

    def count(self, _message):
        self.refreshed += 1

    def step(self):
        if self.calls:
            service, kind, request = self.calls.pop(0)
            self.node.create_client(f"/clips_manager/{service}", kind).call(request, self.answers.append)
        elif not self.values:
            self.client.get(["environments", "executive.publish_on_refresh"], self.values.update)


def make_call(name, kind, **request):
    return (name, f"cx_msgs/srv/{kind}", request)


def make_transition(number):
    return ("change_state", "lifecycle_msgs/srv/ChangeState", {"transition": {"id": number}})


def test_services_manage_environments_and_plugins(tmp_path):
    peer = Peer(
        tmp_path,
        make_call("list_envs", "ListClipsEnvs"),
        make_call("create_env", "CreateClipsEnv", env_name="other"),
        make_call("create_env", "CreateClipsEnv", env_name="other"),
        make_call("list_plugins", "ListClipsPlugins", env_name="other"),
        make_call("load_plugin", "LoadClipsPlugin", env_name="other", plugin_name="executive"),
        make_call("unload_plugin", "UnloadClipsPlugin", env_name="other", plugin_name="example"),
        make_call("unload_plugin", "UnloadClipsPlugin", env_name="other", plugin_name="example"),
        make_call("load_plugin", "LoadClipsPlugin", env_name="nope", plugin_name="example"),
        make_call("load_plugin", "LoadClipsPlugin", env_name="other", plugin_name="nope"),
        make_call("list_plugins", "ListClipsPlugins", env_name="other"),
        make_call("destroy_env", "DestroyClipsEnv", env_name="other"),
        make_call("destroy_env", "DestroyClipsEnv", env_name="other"),
        make_call("list_envs", "ListClipsEnvs"),
    )
    result, _ = peer.run()
    answers = [
        (each["success"], each.get("envs", each.get("plugins")), each["error"]) for each in peer.answers
    ]
    assert answers == [
        (True, ["one"], ""),
        (True, None, ""),
        (False, None, "Enviroment other already exists!"),
        (True, ["example"], ""),
        (True, None, ""),
        (True, None, ""),
        (False, None, "unknown plugin"),
        (False, None, "unknown environment"),
        (False, None, "error while loading plugin"),
        (True, ["executive"], ""),
        (True, None, ""),
        (False, None, "unknown Environment name"),
        (True, ["one"], ""),
    ]
    assert result.status == 1  # the run reports errors
    assert peer.refreshed >= 28
    assert peer.values == {"environments": ["one"], "executive.publish_on_refresh": True}


def test_second_activation_restarts_agent(tmp_path):
    peer = Peer(
        tmp_path,
        make_transition(4),
        make_call("list_envs", "ListClipsEnvs"),
        make_transition(3),
        make_transition(4),
        make_transition(3),
    )
    result, log = peer.run()
    assert [each["success"] for each in peer.answers] == [True] * 5
    assert log.count("hello") == 3
    assert sum("(executive-finalize)" in line for line in log) == 3
    assert result.status == 0


def test_node_without_autostart_waits_for_peer(tmp_path):
    peer = Peer(
        tmp_path,
        ("get_state", "lifecycle_msgs/srv/GetState", {}),
        make_transition(3),
        make_transition(1),
        make_transition(3),
    )
    peer.parameters.write_text(
        peer.parameters.read_text().replace("executive:", "autostart_node: false\n    executive:")
    )
    result, log = peer.run()
    state, *changes = peer.answers
    assert "unconfigured" in str(state["current_state"])
    assert [each["success"] for each in changes] == [False, True, True]
    assert log.count("hello") == 1
    assert result.status == 0


def test_bond_beats_until_deactivation(tmp_path):
    beats: list[dict[str, object]] = []
    peer = Peer(tmp_path, *[("get_state", "lifecycle_msgs/srv/GetState", {})] * 20, make_transition(4))
    peer.subscription = ("/bond", "bond/msg/Status", beats.append)
    peer.parameters.write_text(
        peer.parameters.read_text().replace("executive:", "bond_heartbeat_period: 0.5\n    executive:")
    )
    peer.run()
    assert [beat["active"] for beat in beats] == [True] * 4 + [False]
    assert {(beat["id"], beat["heartbeat_timeout"], beat["heartbeat_period"]) for beat in beats} == {
        ("clips_manager", 4.0, 0.5)
    }
    assert len({beat["instance_id"] for beat in beats}) == 1


@pytest.mark.parametrize(("number", "succeeds"), [(1, False), (2, False), (7, True)])
def test_further_transitions(tmp_path, number, succeeds):
    peer = Peer(tmp_path, make_transition(number))
    result, _ = peer.run()
    assert [each["success"] for each in peer.answers] == [succeeds]
    assert (result.run_seconds < 1) == succeeds
