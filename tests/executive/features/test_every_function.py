"""Each function of Fawkes' features: a valid call with its result, and an invalid call.

The number and types of the arguments are those of ``test_api.py``.
"""

from __future__ import annotations

import json
import re
import socket

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.config import Configuration
from cxbridge.errors import ClipsError
from cxbridge.events import Level
from cxbridge.executive.executive import ENVIRONMENT, CoreFiles, Executive
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.features.config import ConfigFeature, RedefineWarningFeature
from cxbridge.executive.features.navgraph import NavGraphFeature
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge.executive.features.tf import TfFeature
from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.skiller.mapping import ActionSkillMapping
from cxbridge.space.navgraph.graph import NavGraph, NavGraphEdge, NavGraphNode
from cxbridge.space.tf import StampedTransform, Transform, TransformPublisher
from tests.executive.features.conftest import (
    CONFIG,
    HAS_MOTOR_SWITCH,
    HAS_PROTOBUF,
    HAS_ROBOT_MEMORY,
    plugin_features,
)
from tests.executive.features.function_rows import (
    BLACKBOARD,
    ENDS,
    HOST,
    MOTOR_SWITCH,
    OTHERS,
    PROTOBUF,
    TF,
    TOO_MANY,
    Row,
)
from tests.support import SHARED, free_port, needs_shared

if HAS_ROBOT_MEMORY:
    from robot_memory_tests.controlled_store import ControlledStore
    from robot_memory_tests.function_rows import ROBOT_MEMORY
else:
    ROBOT_MEMORY = {}

ROWS: dict[str, Row] = {
    **HOST,
    **BLACKBOARD,
    **OTHERS,
    **TF,
    **(PROTOBUF if HAS_PROTOBUF else {}),
    **(MOTOR_SWITCH if HAS_MOTOR_SWITCH else {}),
    **ROBOT_MEMORY,
}

FEATURES = ("blackboard", "pddl-parser", "tf", "navgraph")

ELSEWHERE = {"skill-call-ext"}
"""Functions of Fawkes' plug-in clips-agent, which precedes the executive with a separate environment."""

DUMPS = {"robmem-dump-collection", "robmem-restore-collection"}
"""The functions that write and read files of mongodump."""

ROW_INTERFACE = """<interface name="RowInterface">
  <data>
    <comment>For rows.</comment>
    <field name="number" type="int32">A number.</field>
    <field name="list" type="int32" length="3">Numbers.</field>
  </data>
  <message name="SetList"><comment>Write both.</comment><ref>list</ref><ref>number</ref></message>
</interface>
"""

DOMAIN = """(define (domain d) (:requirements :strips) (:predicates (held ?t))
 (:action take :parameters (?t) :precondition (held ?t) :effect (not (held ?t))))
"""

LATE = """syntax = "proto2";
package late;
message Late { enum CompType { COMP_ID = 77; MSG_TYPE = 1; } }
"""


class Spare(Feature):
    """A feature without a request."""

    name = "spare"

    def init_context(self, env):
        """Give nothing."""


class World:
    """An executive with all features and their services."""

    def __init__(self, bus, folder):
        (folder / "interfaces").mkdir()
        (folder / "interfaces" / "RowInterface.xml").write_text(ROW_INTERFACE)
        (folder / "msgs" / "sub").mkdir(parents=True)
        (folder / "msgs" / "top.proto").write_text('syntax = "proto2";\nimport "sub/late.proto";\n')
        (folder / "msgs" / "sub" / "late.proto").write_text(LATE)
        (folder / "domain.pddl").write_text(DOMAIN)
        config = Configuration.from_text(CONFIG, "test.yaml")
        self.folder = folder
        self.board = LocalBlackBoard(InterfaceRegistry([folder / "interfaces"]), bus.clock, bus)
        self.store = ControlledStore(bus.clock) if HAS_ROBOT_MEMORY else None
        graph = NavGraph("House")
        for name in ("hall", "kitchen"):
            graph.add_node(NavGraphNode(name, 0, 0))
        graph.add_edge(NavGraphEdge("hall", "kitchen"))
        self.added = plugin_features(bus, self.board, folder / "msgs", store=self.store)
        self.manager = EnvironmentManager(
            bus,
            [
                BlackBoardFeature(self.board),
                ConfigFeature(config),
                PddlParserFeature(),
                RedefineWarningFeature(),
                *self.added,
                TfFeature(self.board),
                NavGraphFeature(lambda: graph),
                Spare(),
            ],
        )
        mapper = ActionSkillMapping({"say": "say{text=?(text)s}"})
        self.executive = Executive(self.manager, config, mapper, CoreFiles())
        self.env = self.executive.env
        self.executive.init()
        for feature in (*FEATURES, *(added_feature.name for added_feature in self.added)):
            assert self.manager.request(ENVIRONMENT, feature) == "TRUE"
        for file in ("plan", "goal", "domain"):
            assert self.env.batch(CORE_DIR / "cx" / f"{file}.clp")
        self.open = [
            self.board.open_for_writing("TestInterface", "Taken"),
            self.board.open_for_writing("RowInterface", "R"),
            self.board.open_for_writing("MotorInterface", "Robotino"),
        ]
        self.robot = TransformPublisher(self.board, "robot")
        self.robot.send(
            StampedTransform(Transform((1.0, 2.0, 0.0), (0.0, 0.0, 0.0, 1.0)), 5_000_000, "map", "robot")
        )
        for way, uid in (("writing", "W"), ("reading", "W"), ("reading", "R")):
            self.env.eval(f'(blackboard-open-{way} "RowInterface" "{uid}")')

    def call(self, body):
        """Return the result of the last action."""
        ports = {name: str(free_port(socket.SOCK_DGRAM)) for name in ("@PORT@", "@OTHER@")}
        for name, value in {"@DIR@": str(self.folder), **ports}.items():
            body = body.replace(name, value)
        body = re.sub(r"'([^']*)'", lambda match: json.dumps(match[1]), body)
        self.env.build(f"(deffunction probe () {body})")
        return self.env.call("probe")

    def close(self):
        if self.store is not None:
            self.store.go.set()
            self.store.set_state("")
        self.robot.close()
        for interface in self.open:
            interface.close()
        self.executive.finalize()
        self.manager.close()
        self.board.shutdown()


@pytest.fixture
def world(bus, log, tmp_path):
    world = World(bus, tmp_path)
    yield world
    world.close()


def problems(log):
    return log.texts(Level.WARN, Level.ERROR)


@pytest.mark.parametrize("name", [name for name, row in ROWS.items() if row.good])
def test_valid_call_succeeds(world, log, name):
    if name in DUMPS:
        pytest.importorskip("pymongo", reason="needs pymongo")
    row = ROWS[name]
    if row.first:
        world.call(row.first)
        world.manager.before_run(ENVIRONMENT)
    before = len(problems(log))
    result = world.call(row.good)
    assert result == row.result
    assert problems(log)[before:] == []
    assert world.env.faults == []


@pytest.mark.parametrize("name", ROWS)
def test_invalid_call_is_reported(world, log, name):
    row = ROWS[name]
    before = len(problems(log))
    if row.bad is TOO_MANY:
        with pytest.raises(ClipsError, match=re.escape(name)):
            world.env.build(f"(deffunction probe () ({name} {'1 ' * 12}))")
    else:
        if row.store:
            world.store.set_state(row.store)
        if row.failure is ENDS:
            with pytest.raises(ClipsError):
                world.call(row.bad)
        else:
            assert world.call(row.bad) == row.failure
        said = problems(log)[before:]
        assert bool(said) == bool(row.told), said
        assert any(row.told in text for text in said) or not said
    assert world.env.faults == []


@needs_shared
def test_each_function_has_row():
    features = json.loads((SHARED / "compat" / "clips-functions.json").read_text())["features"]
    absent = {
        feature
        for feature, is_present in (
            ("protobuf", HAS_PROTOBUF),
            ("motor-switch", HAS_MOTOR_SWITCH),
            ("robot_memory", HAS_ROBOT_MEMORY),
        )
        if not is_present
    }
    names = {
        function["name"]
        for feature in features
        if feature["feature"] not in absent
        for function in feature["functions"]
    }
    assert set(ROWS) == names - ELSEWHERE
