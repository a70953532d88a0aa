"""The original's feature ``blackboard``: a template without hash and serial, facts for one run of rules."""

from __future__ import annotations

import shutil
from typing import Any

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.config import Configuration
from cxbridge.events import EventBus
from cxbridge.executive.host.values import TRUE
from cxbridge.executive.manager import HOST_LIBRARY, EnvironmentManager
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.mainloop import Hook
from cxbridge.run import run_scenario
from cxbridge.run.agent import Run
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge_ros2cx.features import make_features
from cxbridge_ros2cx.parameters import FeatureEntry
from tests.executive.conftest import Log
from tests.support import ROS2CX_DIR, needs_ros2cx

TEMPLATES = """
(deftemplate blackboard-interface (slot id) (slot type) (slot uid) (slot writing))
(deftemplate blackboard-interface-info
  (slot id) (slot type) (slot hash) (slot has-writer) (slot num-readers) (slot writer)
  (multislot readers) (multislot timestamp))
"""


class Bench:
    def __init__(self, tmp_path):
        self.bus = EventBus(VirtualClock())
        self.log = Log(self.bus)
        self.board = LocalBlackBoard(InterfaceRegistry(), VirtualClock(), self.bus)
        library = tmp_path / "library"
        shutil.copytree(HOST_LIBRARY, library)
        (library / "blackboard.clp").write_text(TEMPLATES)
        entries = [FeatureEntry("blackboard", "cx::BlackboardFeature")]
        features = make_features(entries, Configuration(), self.board, lambda: None)
        self.manager = EnvironmentManager(self.bus, features, library)
        self.env = self.manager.create("executive")
        before = self.env.udfs.names
        assert self.manager.request("executive", "blackboard") == TRUE
        self.defined = sorted(self.env.udfs.names - before)

    def facts(self, template):
        return [slots for _, _, slots in self.env.facts(template)]


@pytest.fixture(name="bench")
def _bench(tmp_path):
    bench = Bench(tmp_path)
    yield bench
    bench.manager.close()


def test_what_is_opened_is_told_without_hash_and_serial(bench):
    for function in ("blackboard-open", "blackboard-open-reading"):
        bench.env.eval(f'({function} "PddlGenInterface" "gen")')
    assert bench.facts("blackboard-interface") == [
        {"id": "gen", "type": "PddlGenInterface", "uid": "PddlGenInterface::gen", "writing": "FALSE"}
    ]


def test_a_fact_lives_for_one_run_of_the_rules(bench):
    """The original's feature has retract-early on, Fawkes' has it off."""
    bench.env.eval('(blackboard-open "TestInterface" "T")')
    with bench.board.open_for_writing("TestInterface", "T") as writer:
        writer.test_int = 3
        writer.write()
        bench.env.eval("(blackboard-read)")
        assert [fact["test_int"] for fact in bench.facts("TestInterface")] == [3]
        bench.env.run()
        assert bench.facts("TestInterface") == []


AGENT = """
(defrule mine-open (executive-initialized) (ff-feature-loaded blackboard)
  =>
  (blackboard-preload "Position3DInterface")
  (blackboard-open "TestInterface" "T")
  (blackboard-get-info)
  (blackboard-enable-time-read))
"""


@needs_ros2cx
def test_an_agent_of_the_original_asks_for_it(tmp_path):
    """The unchanged checkout, but for a line of its parameters that names the plugin."""
    assert ROS2CX_DIR is not None
    checkout = tmp_path / "checkout"
    for package in ROS2CX_DIR.iterdir():
        if package.is_dir() and package.name != ".git":
            shutil.copytree(package, checkout / package.name)
    parameters = checkout / "cx_bringup" / "params"
    features = (parameters / "cx_params.yaml").read_text()
    features = features.replace('"skill_execution"]', '"skill_execution", "blackboard"]')
    features = features.replace(
        "    mock_feature:\n", '    blackboard: {plugin: "cx::BlackboardFeature"}\n    mock_feature:\n'
    )
    (parameters / "cx_params.yaml").write_text(features)
    (tmp_path / "mine.clp").write_text(AGENT)
    (tmp_path / "mine.yaml").write_text(
        "clips-executive: {specs: {mine: {init: {stage-1: [{name: blackboard}], "
        "stage-3: [{name: mine, file: mine.clp}]}}}}\n"
    )
    options = options_from_keywords(
        None,
        ros2cx=checkout,
        spec="mine",
        config=tmp_path / "mine.yaml",
        clips_dirs=(tmp_path,),
        timeout=3.0,
    )
    seen: dict[str, Any] = {}

    def attach(agent: Run) -> None:
        def look() -> None:
            env = agent.executive.env
            if env.has_template("TestInterface"):
                seen["preloaded"] = env.has_template("Position3DInterface")
                seen["opened"] = [slots["uid"] for _, _, slots in env.facts("blackboard-interface")]
                seen["faults"] = list(env.faults)

        agent.loop.add(Hook.POST_LOOP, look)

    run_scenario(options, None, attach)
    assert seen == {"preloaded": True, "opened": ["TestInterface::T"], "faults": []}
