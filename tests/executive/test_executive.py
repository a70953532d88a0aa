"""The executive with a small agent."""

from __future__ import annotations

import pytest

from cxbridge.config import Configuration
from cxbridge.errors import ExecutiveError
from cxbridge.events import Level
from cxbridge.executive.executive import CoreFiles, Executive, read_action_mapping
from cxbridge.executive.features.config import ConfigFeature, RedefineWarningFeature
from cxbridge.executive.manager import EnvironmentManager
from cxbridge.skiller.mapping import ActionSkillMapping
from tests.executive.fake_skiller import FakeSkiller

CONFIG = """
clips-executive:
  assert-time-each-loop: true
  spec: small
  specs:
    small:
      init:
        stage-1:
          - name: {feature}
        stage-3:
          - name: agent
            file: agent.clp
      action-mapping:
        say: say{{text=?(text)s}}
        go: go{{n=?(n)i, x=?(x)f}}
"""


def make(bus, tmp_path, agent, feature="redefine-warning"):
    (tmp_path / "agent.clp").write_text(agent)
    config = Configuration.from_text(CONFIG.format(feature=feature), "test.yaml")
    features = [FakeSkiller(), ConfigFeature(config), RedefineWarningFeature()]
    manager = EnvironmentManager(bus, features)
    mapper = ActionSkillMapping(read_action_mapping(config, "small"))
    return Executive(manager, config, mapper, CoreFiles(clips_dirs=(tmp_path,)))


AGENT = """
(defrule agent-tick (executive-initialized) (time ?sec ?usec) => (assert (ticked ?sec)))
(defrule agent-bye (executive-finalize) => (printout t "bye" crlf))
"""


def test_agent_is_loaded_and_gets_time_in_each_loop(bus, tmp_path):
    executive = make(bus, tmp_path, AGENT)
    executive.init()
    assert executive.is_initialized
    executive.loop()
    assert [values["implied"] for _, _, values in executive.env.facts("ticked")] == [(1_000_000_000,)]
    assert list(executive.env.facts("time")) == []


def test_rules_fire_at_finalization(bus, log, tmp_path):
    executive = make(bus, tmp_path, AGENT)
    executive.init()
    executive.finalize()
    assert "bye" in log.texts(Level.INFO)


def test_unknown_feature_is_one_error(bus, tmp_path):
    executive = make(bus, tmp_path, AGENT, feature="telepathy")
    with pytest.raises(ExecutiveError, match="Feature telepathy is not available") as caught:
        executive.init()
    assert "redefine-warning" in str(caught.value.hint)
    assert caught.value.exit_status == 2


def test_parameters_without_name_or_text(bus, log, tmp_path):
    executive = make(bus, tmp_path, AGENT)
    executive.init()
    env = executive.env
    assert env.eval("(map-action-skill say (create$ 5) (create$ hi))") == ""
    env.build("(deftemplate thing (slot x))")
    env.build(
        "(deffunction probe () (map-action-skill go (create$ n x y) (create$ 3 1.5 (assert (thing (x 1))))))"
    )
    assert env.eval("(probe)") == "go{n=3, x=1.500000}"
    assert log.texts(Level.ERROR)[-2:] == [
        "Param for 'say' is not a string or symbol",
        "Param 'y' for action 'go' of invalid type",
    ]


def test_endless_rules_at_finalization_are_ended(bus, log, tmp_path, monkeypatch):
    monkeypatch.setattr("cxbridge.executive.executive.MAX_FINAL_FIRINGS", 50)
    circle = "(defrule circle (executive-finalize) ?f <- (n ?i) => (retract ?f) (assert (n (+ ?i 1))))"
    executive = make(bus, tmp_path, f"(deffacts start (n 0)) {circle}")
    executive.init()
    executive.env.assert_string("(n 0)")
    executive.finalize()
    assert any("fire in a cycle" in text for text in log.texts(Level.WARN))
