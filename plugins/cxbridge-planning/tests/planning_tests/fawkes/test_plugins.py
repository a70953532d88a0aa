"""The generation of problems and plans with the blackboard and the robot memory."""

from __future__ import annotations

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.events import Level
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge_planning import PlanningService
from cxbridge_planning.fawkes.plugins import PddlPlanner, PddlRobotMemory, ProblemFiles
from cxbridge_robot_memory.embedded import EmbeddedStore

DOMAIN = """(define (domain d) (:requirements :strips :typing) (:types name text) (:constants HI BYE - text)
  (:predicates (said ?n - name ?t - text))
  (:action greet :parameters (?n - name) :precondition (not (said ?n HI)) :effect (said ?n HI))
  (:action leave :parameters (?n - name) :precondition (said ?n HI) :effect (said ?n BYE)))"""

TEMPLATE = """(define (problem p) (:domain d)
  (:objects <<#OBJECTS|{"relation": "domain-object"}>> <<name>> - <<type>><</OBJECTS>>)
  (:init <<#FACTS|{"relation": "domain-fact"}>>(<<name>> <<param_values>>)<</FACTS>>)
  (:goal <<GOAL>>))"""

CONFIG = """
plugins/pddl-robot-memory:
  collection: robmem.clipswm
  input-problem-description: template.pddl
  output-problem-description: problem.pddl
plugins/pddl-planner:
  planner: {planner}
  description-folder: >
    "@CONFDIR@/"
  domain-description: domain.pddl
  problem-description: problem.pddl
"""


@pytest.fixture
def bench(bus, log, tmp_path):
    return PluginBench(bus, log, tmp_path)


class PluginBench:
    """The plugins, and the instances of an agent."""

    def __init__(self, bus, log, folder):
        self.bus, self.log, self.folder = bus, log, folder
        self.board = LocalBlackBoard(InterfaceRegistry(), bus.clock, bus)
        self.store = EmbeddedStore(bus.clock)
        self.store.insert("robmem.clipswm", {"relation": "domain-object", "name": "EVE", "type": "name"})
        (folder / "domain.pddl").write_text(DOMAIN)
        (folder / "template.pddl").write_text(TEMPLATE)
        self.plugins = []

    def start(self, planner="pyperplan", timeout=60, **options):
        text = CONFIG.replace("{planner}", planner) + f"planner: {{timeout: {timeout}}}\n"
        config = Configuration.from_text(text, "test.yaml")
        files = ProblemFiles({"@CONFDIR@": str(self.folder)}, self.folder, **options)
        self.plugins = [
            PddlRobotMemory(self.board, self.bus, config, self.store, files),
            PddlPlanner(self.board, self.bus, config, self.store, files, PlanningService()),
        ]
        self.generator = self.board.open_for_reading("PddlGenInterface", "pddl-gen")
        self.planner = self.board.open_for_reading("PddlPlannerInterface", "pddl-planner")

    def loop(self):
        for plugin in self.plugins:
            plugin.loop()
        self.generator.read()
        self.planner.read()

    def send(self, interface, kind, **fields):
        message = interface.create_message(kind)
        for name, value in fields.items():
            message.set(name, value)
        number = interface.msgq_enqueue(message)
        self.loop()
        return number

    def plan(self, goal):
        """Request a problem for a goal, and a plan."""
        self.send(self.generator, "GenerateMessage", goal=goal)
        self.loop()
        self.send(self.planner, "PlanMessage")
        self.loop()

    def plans(self):
        return [
            {key: value for key, value in document.items() if key != "_id"}
            for document in self.store.find("robmem.pddl-plan")
        ]

    def close(self):
        for plugin in self.plugins:
            plugin.close()
        self.board.shutdown()


@pytest.fixture(autouse=True)
def _close(bench):
    yield
    bench.close()


def test_goal_becomes_problem_and_plan(bench):
    bench.start()
    number = bench.send(bench.generator, "GenerateMessage", goal="(said EVE BYE)")
    assert (bench.generator.msg_id, bench.generator.final) == (number, False)
    bench.loop()
    assert (bench.generator.msg_id, bench.generator.final) == (number, True)
    number = bench.send(bench.planner, "PlanMessage")
    assert (bench.planner.msg_id, bench.planner.final, bench.planner.success) == (number, False, False)
    bench.loop()
    assert (bench.planner.msg_id, bench.planner.final, bench.planner.success) == (number, True, True)
    assert bench.plans() == [
        {
            "plan": 1,
            "msg_id": number,
            "actions": [{"name": "greet", "args": ["EVE"]}, {"name": "leave", "args": ["EVE"]}],
        }
    ]


def test_problem_has_facts_of_robot_memory(bench):
    fact = {"relation": "domain-fact", "name": "said", "param_values": ["EVE", "HI"]}
    bench.store.insert("robmem.clipswm", fact)
    bench.start()
    bench.plan("(said EVE BYE)")
    assert [step["name"] for step in bench.plans()[0]["actions"]] == ["leave"]


def test_plan_is_stored_before_interface_is_final(bench):
    bench.start()
    final_flags = []

    def record_final(_change):
        bench.planner.read()
        final_flags.append(bench.planner.final)

    bench.store.watch("robmem.pddl-plan", {}, record_final)
    bench.plan("(said EVE BYE)")
    assert final_flags == [False]


@pytest.mark.parametrize(
    ("goal", "message"),
    [
        ("(said EVE", "never closed"),
        ("(sung EVE BYE)", "Unknown predicate: sung"),
        ("(said MALLORY BYE)", "MALLORY"),
        ("(and (said EVE HI) (not (said EVE HI)))", "there is no plan"),
    ],
)
def test_failed_planning_stores_no_plan(bench, goal, message):
    bench.start()
    bench.plan(goal)
    assert (bench.planner.final, bench.planner.success) == (True, False)
    assert bench.plans() == [{"plan": 0}]
    assert any(message in text for text in bench.log.texts(Level.ERROR))


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"relation": "domain-object", "name": "X", "type": "unheard-of"}, "unheard-of"),
        ({"relation": "domain-object", "name": "X"}, "unexpected ')' in (:objects ...)"),
        ({"relation": "domain-object", "name": ["X"], "type": {"a": 1}}, "unexpected"),
        ({"relation": "domain-fact", "name": "sung", "param_values": ["EVE", "BYE"]}, "sung"),
        ({"relation": "domain-fact", "name": "said", "param_values": ["MALLORY", "HI"]}, "MALLORY"),
        ({"relation": "domain-fact", "name": "said", "param_values": 5}, "expected 2 but got 1"),
        ({"relation": "domain-fact", "name": "said", "param_values": ["EVE"]}, "expected 2 but got 1"),
        ({"relation": "domain-fact", "name": ")(", "param_values": []}, "unexpected ')'"),
    ],
)
def test_invalid_document_fails_planning_until_removal(bench, document, message):
    bench.store.insert("robmem.clipswm", {"_id": "bad", **document})
    bench.start()
    for success in (False, True):
        bench.plan("(said EVE BYE)")
        assert (bench.planner.final, bench.planner.success) == (True, success)
        assert bench.plans()[-1]["plan"] == int(success)
        errors = [text for text in bench.log.texts(Level.ERROR) if message in text]
        assert len(errors) == 1
        bench.store.remove("robmem.clipswm", {"_id": "bad"})


@pytest.mark.parametrize("text", ["(define (domain d", DOMAIN.replace("- name ?t", "- thing ?t"), "", None])
def test_invalid_domain_fails_planning(bench, text):
    bench.start()
    file = bench.folder / "domain.pddl"
    if text is None:
        file.unlink()
    else:
        file.write_text(text)
    bench.plan("(said EVE BYE)")
    assert (bench.planner.final, bench.planner.success) == (True, False)
    assert bench.plans() == [{"plan": 0}]
    assert any("domain.pddl" in error for error in bench.log.texts(Level.ERROR))


def test_empty_goal_repeats_last_goal(bench):
    bench.start()
    for goal in ("(said EVE HI)", ""):
        bench.send(bench.generator, "GenerateMessage", goal=goal)
        bench.loop()
    bench.send(bench.planner, "PlanMessage")
    bench.loop()
    assert [step["name"] for step in bench.plans()[0]["actions"]] == ["greet"]


def test_missing_planner_is_replaced(bench, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    bench.start("ff")
    bench.loop()
    assert bench.planner.active_planner == "ff"
    assert any("ff is not installed" in text for text in bench.log.texts(Level.WARN))
    bench.plan("(said EVE HI)")
    assert bench.planner.success


def test_missing_template_is_reported(bench):
    bench.start()
    (bench.folder / "template.pddl").unlink()
    bench.send(bench.generator, "GenerateMessage", goal="(said EVE HI)")
    bench.loop()
    assert bench.generator.final  # like in Fawkes
    assert any("cannot read the problem template" in text for text in bench.log.texts(Level.ERROR))


@pytest.mark.parametrize("writes_to_disk", [True, False])
def test_problem_is_written_to_disk_on_request(bench, writes_to_disk):
    bench.start(writes_to_disk=writes_to_disk)
    bench.send(bench.generator, "GenerateMessage", goal="(said EVE HI)")
    bench.loop()
    texts = [file.read_text() for file in bench.folder.glob("problem.pddl")]
    assert ["(:goal (said EVE HI))" in text for text in texts] == [True] * writes_to_disk


def test_missing_setting_is_reported(bench):
    config = Configuration.from_text("plugins/pddl-planner: {planner: auto}", "test.yaml")
    with pytest.raises(ConfigError, match="pddl-robot-memory/collection"):
        PddlRobotMemory(bench.board, bench.bus, config, bench.store, ProblemFiles({}, bench.folder))
