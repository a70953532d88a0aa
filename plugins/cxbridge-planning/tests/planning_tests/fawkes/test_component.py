"""Fawkes' planning plugins in a daemon."""

from __future__ import annotations

from typing import Any

from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.run.components.manager import State
from cxbridge_robot_memory.component import robot_memory
from planning_tests.fawkes.test_plugins import CONFIG, DOMAIN, TEMPLATE
from tests.run.mini import write_scenario
from tests.run.test_components import SILENT, components


def test_daemon_plans_on_messages_of_blackboard(tmp_path):
    """The component replaces the plugins pddl-robot-memory and pddl-planner; the spec loads pddl-init.clp."""
    folder = write_scenario(tmp_path)
    (folder / "domain.pddl").write_text(DOMAIN)
    (folder / "template.pddl").write_text(TEMPLATE)
    file = folder / "scenario.yaml"
    text = file.read_text().replace("[mini.clp,", "[mini.clp, pddl-init.clp,")
    file.write_text(text.replace("pddl-parser", "robot_memory") + CONFIG.replace("{planner}", "pyperplan"))
    daemon = Daemon(DaemonOptions(config=folder, settings=SILENT))
    daemon.lifecycle.startup()
    assert components(daemon)["planning"] is State.ACTIVE, daemon.component_statuses()
    document = {"relation": "domain-object", "name": "EVE", "type": "name"}
    store = robot_memory(daemon).open()
    store.insert("robmem.clipswm", document)
    generator = daemon.board.open_for_reading("PddlGenInterface", "pddl-gen", owner="test")
    planner: Any = daemon.board.open_for_reading("PddlPlannerInterface", "pddl-planner", owner="test")
    (node,) = (node for node in daemon.lifecycle.nodes if node.name == "planning")
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
    daemon.lifecycle.shutdown()
