"""The simulator and the static estimator, by section 6 of the facts."""

from __future__ import annotations

import pytest

from cxbridge.config import Configuration
from cxbridge.events import Level
from cxbridge.skiller.simulation.estimators import SkillPattern, StaticEstimator
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from cxbridge.skiller.skillstring import parse_skill_call
from tests.skiller.rig import Rig


def make(*estimators: StaticEstimator) -> Rig:
    rig = Rig()
    rig.add(SkillerSimulator(rig.board, rig.clock, rig.bus, estimators))
    return rig


def test_acquire_control_sets_msgid():
    rig = make()
    number = rig.send("AcquireControl", False)
    rig.loop()
    assert rig.state.msgid == number


def test_skill_takes_estimated_time_and_keeps_string_and_msgid():
    rig = make(StaticEstimator(seconds=1.0, speed=2.0))
    number = rig.exec("say{}")
    loops = 0
    while rig.status == "S_RUNNING":
        rig.loop()
        loops += 1
    assert loops == 16  # half a second, and a loop
    assert (rig.status, rig.state.msgid, rig.state.skill_string) == ("S_FINAL", number, "say{}")


def test_new_skill_string_restarts_time():
    rig = make(StaticEstimator(seconds=0.1))
    rig.exec("a{}", loops=3)
    rig.exec("b{}", loops=2)
    assert rig.status == "S_RUNNING"
    assert "Aborting execution of previous skill string 'a{}' for new goal" in rig.logged(Level.INFO)


@pytest.mark.parametrize(("text", "column"), [("say{", 5), ("x = 1", 3)])
def test_invalid_skill_string_fails_with_column(text: str, column: int):
    rig = make()
    rig.exec(text)
    assert rig.status == "S_FAILED"
    assert rig.state.error.startswith(f"column {column}: ")


def test_skill_without_estimate_fails():
    rig = make(StaticEstimator(whitelist=[SkillPattern("say", seconds=1.0)]))
    rig.exec("dance{}")
    assert (rig.status, rig.state.error) == ("S_FAILED", "no estimator has a duration for 'dance'")


CONFIG = """
plugins/execution-time-estimator:
  static:
    priority: 3
    speed: 2
    exec-time: 3
    whitelist:
      99-default-say:
        name: say
        exec-time: 12
      01-say-hello-world:
        name: say
        args: ["text=hello .*", "wait=.*"]
        exec-time: 17
    blacklist:
      no-driving:
        name: moveto
"""


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ('say{text="hello world", wait=true}', 8.5),
        ('say{text="bye", wait=true}', 6.0),
        ("other()", 1.5),
        ("moveto{}", None),
    ],
)
def test_configuration_sets_static_durations(text: str, seconds: float | None):
    estimator = StaticEstimator.from_config(Configuration.from_text(CONFIG))
    outcome = estimator.decide(parse_skill_call(text))
    assert (None if outcome is None else outcome.seconds) == seconds
    assert estimator.priority == 3
