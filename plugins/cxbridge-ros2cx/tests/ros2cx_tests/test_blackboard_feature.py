"""The feature ``blackboard`` of the original, and its differences from Fawkes."""

from __future__ import annotations

import shutil

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.config import Configuration
from cxbridge.events import EventBus, Level
from cxbridge.executive.host.values import TRUE
from cxbridge.executive.manager import HOST_LIBRARY, EnvironmentManager
from cxbridge.interfaces import InterfaceRegistry
from cxbridge_ros2cx.features import make_features
from cxbridge_ros2cx.parameters import FeatureEntry
from tests.executive.conftest import Log

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


def test_fact_of_opened_interface_lacks_hash_and_serial(bench):
    for function in ("blackboard-open", "blackboard-open-reading"):
        bench.env.eval(f'({function} "PddlGenInterface" "gen")')
    assert bench.facts("blackboard-interface") == [
        {"id": "gen", "type": "PddlGenInterface", "uid": "PddlGenInterface::gen", "writing": "FALSE"}
    ]


def test_data_fact_is_retracted_after_run_of_rules(bench):
    """The feature of the original enables retract-early, in contrast to Fawkes."""
    bench.env.eval('(blackboard-open "TestInterface" "T")')
    with bench.board.open_for_writing("TestInterface", "T") as writer:
        writer.test_int = 3
        writer.write()
        bench.env.eval("(blackboard-read)")
        assert [fact["test_int"] for fact in bench.facts("TestInterface")] == [3]
        bench.env.run()
        assert bench.facts("TestInterface") == []


def test_functions_beyond_fawkes_are_defined(bench):
    bench.env.eval('(blackboard-preload "Position3DInterface")')
    bench.env.eval('(blackboard-open "TestInterface" "T")')
    bench.env.eval("(blackboard-get-info)")
    bench.env.eval("(blackboard-enable-time-read)")
    assert bench.env.has_template("Position3DInterface")
    assert [fact["type"] for fact in bench.facts("blackboard-interface-info")] == ["TestInterface"]
    assert bench.log.texts(Level.ERROR) == []
