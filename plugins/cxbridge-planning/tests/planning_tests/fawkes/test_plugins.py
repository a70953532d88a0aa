"""Problem generation and planning by the blackboard and the robot memory."""

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
def world(bus, log, tmp_path):
    return World(bus, log, tmp_path)


class World:
    """The plugins, and an agent that talks to them."""

    def __init__(self, bus, log, folder):
        self.bus, self.log, self.folder = bus, log, folder
        self.board = LocalBlackBoard(InterfaceRegistry(), bus.clock, bus)
        self.store = EmbeddedStore(bus.clock)
        self.store.insert("robmem.clipswm", {"relation": "domain-object", "name": "EVE", "type": "name"})
        (folder / "domain.pddl").write_text(DOMAIN)
        (folder / "template.pddl").write_text(TEMPLATE)
        self.plugins = []

    def start(self, planner="pyperplan", timeout=60, **more):
        text = CONFIG.replace("{planner}", planner) + f"planner: {{timeout: {timeout}}}\n"
        config = Configuration.from_text(text, "test.yaml")
        files = ProblemFiles({"@CONFDIR@": str(self.folder)}, self.folder, **more)
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

    def ask(self, interface, kind, **fields):
        message = interface.create_message(kind)
        for name, value in fields.items():
            message.set(name, value)
        number = interface.msgq_enqueue(message)
        self.loop()
        return number

    def plan(self, goal):
        """Have a problem generated for a goal, and a plan made."""
        self.ask(self.generator, "GenerateMessage", goal=goal)
        self.loop()
        self.ask(self.planner, "PlanMessage")
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
def _close(world):
    yield
    world.close()


def test_from_goal_to_plan(world):
    world.start()
    number = world.ask(world.generator, "GenerateMessage", goal="(said EVE BYE)")
    assert (world.generator.msg_id, world.generator.final) == (number, False)
    world.loop()
    assert (world.generator.msg_id, world.generator.final) == (number, True)
    number = world.ask(world.planner, "PlanMessage")
    assert (world.planner.msg_id, world.planner.final, world.planner.success) == (number, False, False)
    world.loop()
    assert (world.planner.msg_id, world.planner.final, world.planner.success) == (number, True, True)
    assert world.plans() == [
        {
            "plan": 1,
            "msg_id": number,
            "actions": [{"name": "greet", "args": ["EVE"]}, {"name": "leave", "args": ["EVE"]}],
        }
    ]


def test_facts_of_the_robot_memory_count(world):
    fact = {"relation": "domain-fact", "name": "said", "param_values": ["EVE", "HI"]}
    world.store.insert("robmem.clipswm", fact)
    world.start()
    world.plan("(said EVE BYE)")
    assert [step["name"] for step in world.plans()[0]["actions"]] == ["leave"]


def test_the_plan_is_in_the_memory_before_the_interface_says_so(world):
    world.start()
    seen = []

    def look(_change):
        world.planner.read()
        seen.append(world.planner.final)

    world.store.watch("robmem.pddl-plan", {}, look)
    world.plan("(said EVE BYE)")
    assert seen == [False]


@pytest.mark.parametrize(
    ("goal", "message"),
    [
        ("(said EVE", "never closed"),
        ("(sung EVE BYE)", "Unknown predicate: sung"),
        ("(said NOBODY BYE)", "NOBODY"),
        ("(and (said EVE HI) (not (said EVE HI)))", "there is no plan"),
    ],
)
def test_no_plan(world, goal, message):
    world.start()
    world.plan(goal)
    assert (world.planner.final, world.planner.success) == (True, False)
    assert world.plans() == [{"plan": 0}]
    assert any(message in text for text in world.log.texts(Level.ERROR))


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"relation": "domain-object", "name": "X", "type": "unheard-of"}, "unheard-of"),
        ({"relation": "domain-object", "name": "X"}, "unexpected ')' in (:objects ...)"),
        ({"relation": "domain-object", "name": ["X"], "type": {"a": 1}}, "unexpected"),
        ({"relation": "domain-fact", "name": "sung", "param_values": ["EVE", "BYE"]}, "sung"),
        ({"relation": "domain-fact", "name": "said", "param_values": ["NOBODY", "HI"]}, "NOBODY"),
        ({"relation": "domain-fact", "name": "said", "param_values": 5}, "expected 2 but got 1"),
        ({"relation": "domain-fact", "name": "said", "param_values": ["EVE"]}, "expected 2 but got 1"),
        ({"relation": "domain-fact", "name": ")(", "param_values": []}, "unexpected ')'"),
    ],
)
def test_a_document_that_makes_no_sense_and_goes_again(world, document, message):
    world.store.insert("robmem.clipswm", {"_id": "bad", **document})
    world.start()
    for success in (False, True):
        world.plan("(said EVE BYE)")
        assert (world.planner.final, world.planner.success) == (True, success)
        assert world.plans()[-1]["plan"] == int(success)
        errors = [text for text in world.log.texts(Level.ERROR) if message in text]
        assert len(errors) == 1
        world.store.remove("robmem.clipswm", {"_id": "bad"})


@pytest.mark.parametrize("text", ["(define (domain d", DOMAIN.replace("- name ?t", "- thing ?t"), "", None])
def test_a_domain_that_does_not_parse(world, text):
    world.start()
    file = world.folder / "domain.pddl"
    if text is None:
        file.unlink()
    else:
        file.write_text(text)
    world.plan("(said EVE BYE)")
    assert (world.planner.final, world.planner.success) == (True, False)
    assert world.plans() == [{"plan": 0}]
    assert any("domain.pddl" in error for error in world.log.texts(Level.ERROR))


def test_an_empty_goal_is_the_one_before(world):
    world.start()
    for goal in ("(said EVE HI)", ""):
        world.ask(world.generator, "GenerateMessage", goal=goal)
        world.loop()
    world.ask(world.planner, "PlanMessage")
    world.loop()
    assert [step["name"] for step in world.plans()[0]["actions"]] == ["greet"]


def test_a_planner_that_is_not_installed_is_replaced(world, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    world.start("ff")
    world.loop()
    assert world.planner.active_planner == "ff"
    assert any("ff is not installed" in text for text in world.log.texts(Level.WARN))
    world.plan("(said EVE HI)")
    assert world.planner.success


def test_a_template_that_is_not_there(world):
    world.start()
    (world.folder / "template.pddl").unlink()
    world.ask(world.generator, "GenerateMessage", goal="(said EVE HI)")
    world.loop()
    assert world.generator.final  # as in Fawkes
    assert any("cannot read the problem template" in text for text in world.log.texts(Level.ERROR))


@pytest.mark.parametrize("writes_to_disk", [True, False])
def test_the_problem_is_on_disk_when_asked_for(world, writes_to_disk):
    world.start(writes_to_disk=writes_to_disk)
    world.ask(world.generator, "GenerateMessage", goal="(said EVE HI)")
    world.loop()
    texts = [file.read_text() for file in world.folder.glob("problem.pddl")]
    assert ["(:goal (said EVE HI))" in text for text in texts] == [True] * writes_to_disk


def test_a_configuration_that_lacks_something(world):
    config = Configuration.from_text("plugins/pddl-planner: {planner: auto}", "test.yaml")
    with pytest.raises(ConfigError, match="pddl-robot-memory/collection"):
        PddlRobotMemory(world.board, world.bus, config, world.store, ProblemFiles({}, world.folder))
