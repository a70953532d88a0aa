"""A component in one file, brought along by an installed package; the example of docs/daemon.md is one."""

from __future__ import annotations

import re
import sys
from typing import Any

import pytest

from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.lifecycle import State
from cxbridge.daemon.nodes import ComponentNode
from cxbridge.daemon.options import DaemonOptions
from cxbridge.run import Assembly, RunOptions
from cxbridge.run.components.component import GROUP, ComponentError
from tests.daemon.test_daemon import QUIET, running
from tests.executive.planning.test_plugins import CONFIG, DOMAIN, TEMPLATE
from tests.run.mini import write_scenario
from tests.support import ROOT

SILENT = (*QUIET, ("skiller", "none"))
UID = ("SwitchInterface", "Heartbeat")


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Installs a package with the example, and what else is given."""
    folder = tmp_path / "site"
    information = folder / "heartbeat-1.0.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: heartbeat\nVersion: 1.0\n")
    section = (ROOT / "docs" / "daemon.md").read_text().partition("### A component of your own")[2]
    python, toml = (re.findall(rf"```{kind}\n(.*?)```", section, re.DOTALL)[0] for kind in ("python", "toml"))
    (folder / "heartbeat.py").write_text(python)
    monkeypatch.syspath_prepend(str(folder))

    def write(entries=""):
        line = toml.splitlines()[1].replace('"', "")
        (information / "entry_points.txt").write_text(f"[{GROUP}]\n{line}\n{entries}\n")

    yield write
    sys.modules.pop("heartbeat", None)


def components(daemon):
    return {status.name: status.state for status in daemon.components()}


def test_a_daemon_manages_it(install):
    install()
    with running(settings=SILENT) as (daemon, _, outcome):
        assert components(daemon)["heartbeat"] is State.ACTIVE
        assert daemon.board.list(*UID)[0].has_writer
    assert outcome == [0]
    daemon = Daemon(DaemonOptions(settings=SILENT))
    daemon.manager.startup()
    daemon.manager.change_one("heartbeat", "deactivate")
    assert daemon.board.list(*UID)[0].has_writer
    daemon.manager.stop_one("heartbeat")
    assert not daemon.board.list(*UID)
    daemon.manager.start_one("heartbeat")
    assert [node.description for node in daemon.manager.nodes if not node.steady] == ["Counts loops"]
    daemon.manager.shutdown()


def test_a_run_has_it(install, tmp_path):
    install()
    with Assembly(RunOptions(scenario=write_scenario(tmp_path / "s"))) as assembly:
        assembly.start()
        reader = assembly.board.open_for_reading(*UID, owner="test")
        assembly.loop.run(lambda: assembly.loop.loops >= 3)
        reader.read()
        assert reader.as_dict()["value"] == 3.0


def test_it_is_gone_with_its_package():
    daemon = Daemon(DaemonOptions(settings=SILENT))
    assert "heartbeat" not in components(daemon)
    daemon.manager.shutdown()


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("broken = nowhere:Nothing", "ModuleNotFoundError"),
        ("broken = heartbeat:Hook", "is not a subclass"),
        ("web = heartbeat:Heartbeat", None),
        ("blackboard = heartbeat:Heartbeat", "two components are called 'blackboard'"),
    ],
)
def test_a_component_that_cannot_be_used_is_an_error_at_the_start(install, entry, message):
    install(entry)
    if message is None:  # the name of a component that this daemon does not have
        assert "web" in components(Daemon(DaemonOptions(settings=SILENT)))
        return
    with pytest.raises(ComponentError, match=message):
        Daemon(DaemonOptions(settings=SILENT))


def test_a_daemon_plans_for_its_agent_by_the_blackboard(tmp_path):
    """As Fawkes' plugins pddl-robot-memory and pddl-planner: the agent's spec loads pddl-init.clp."""
    folder = write_scenario(tmp_path)
    (folder / "domain.pddl").write_text(DOMAIN)
    (folder / "template.pddl").write_text(TEMPLATE)
    file = folder / "scenario.yaml"
    text = file.read_text().replace("[mini.clp,", "[mini.clp, pddl-init.clp,")
    file.write_text(text.replace("pddl-parser", "robot_memory") + CONFIG.replace("{planner}", "pyperplan"))
    daemon = Daemon(DaemonOptions(config=folder, settings=SILENT))
    daemon.manager.startup()
    assert components(daemon)["planning"] is State.ACTIVE, daemon.components()
    document = {"relation": "domain-object", "name": "EVE", "type": "name"}
    store = daemon.context.memory.store
    store.insert("robmem.clipswm", document)
    generator = daemon.board.open_for_reading("PddlGenInterface", "pddl-gen", owner="test")
    planner: Any = daemon.board.open_for_reading("PddlPlannerInterface", "pddl-planner", owner="test")
    (node,) = (node for node in daemon.manager.nodes if node.name == "planning")
    assert isinstance(node, ComponentNode)
    message = generator.create_message("GenerateMessage")
    message.set("goal", "(said EVE BYE)")
    generator.msgq_enqueue(message)
    node.step()
    node.step()
    planner.msgq_enqueue(planner.create_message("PlanMessage"))
    for _ in range(2000):
        node.step()
        planner.read()
        if planner.final and planner.success:
            break
        daemon.clock.sleep_until(daemon.clock.now_us() + 10_000)
    (plan,) = store.find("robmem.pddl-plan", {"plan": 1})
    assert [action["name"] for action in plan["actions"]] == ["greet", "leave"]
    daemon.manager.shutdown()
