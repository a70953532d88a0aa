"""A second goal with the same id has separate lives in the history, in `why` and on the page."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.resources import shipped_dir
from cxbridge.run.options import RunOptions
from cxbridge.run.program.finished import open_run
from cxbridge.run.run import run_scenario
from cxbridge.trace.convert import convert

AGENT = """
(deftemplate round (slot number))
(defrule first (executive-initialized) => (assert (round (number 1))))
(defrule begin
  (executive-initialized) (round (number ?n&:(< ?n 3))) (not (goal))
  =>
  (assert (goal (id HOUSE) (class VISIT)))
  (assert (goal (id ROOM) (class LOOK) (parent HOUSE) (params round ?n))))
(defrule on
  ?g <- (goal (mode ?mode&FORMULATED|SELECTED|EXPANDED|COMMITTED|DISPATCHED|FINISHED|EVALUATED) (meta $?last))
  (round (number ?n)) (time $? ?now&:(not (member$ ?now ?last)))
  =>
  (bind ?modes (create$ FORMULATED SELECTED EXPANDED COMMITTED DISPATCHED FINISHED EVALUATED RETRACTED))
  (bind ?next (nth$ (+ 1 (member$ ?mode ?modes)) ?modes))
  (if (eq ?next FINISHED)
   then (modify ?g (meta ?now) (mode FINISHED) (outcome (if (= ?n 1) then FAILED else COMPLETED)))
   else (modify ?g (meta ?now) (mode ?next))))
(defrule again
  "The goals of the next round have the ids of the last one."
  ?r <- (round (number ?n)) (goal (id HOUSE) (mode RETRACTED)) (goal (id ROOM) (mode RETRACTED))
  =>
  (modify ?r (number (+ 1 ?n)))
  (do-for-all-facts ((?g goal)) TRUE (retract ?g)))
"""

SCENARIO = """%YAML 1.2
---
clips-executive:
  spec: twice
  clips-dirs: []
  assert-time-each-loop: true
  automatic-goal-retraction: false
  specs:
    twice:
      init:
        stage-3:
          - name: twice
            file: twice.clp
"""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("twice")
    (folder / "scenario.yaml").write_text(SCENARIO)
    (folder / "twice.clp").write_text(AGENT)
    run_scenario(RunOptions(scenario=folder, trace=folder / "run.mcap", trace_level="facts", timeout=20.0))
    return folder / "run.mcap"


def test_run_has_both_lives_of_goals(recorded: Path):
    run = open_run(recorded)
    assert [(goal.name, goal.outcome) for goal in run.goals] == [
        ("HOUSE", "FAILED"),
        ("ROOM", "FAILED"),
        ("HOUSE#2", "COMPLETED"),
        ("ROOM#2", "COMPLETED"),
    ]
    assert run.goal("ROOM#2").outcome == run.goal("LOOK#2").outcome == "COMPLETED"
    with pytest.raises(CxbridgeError):
        run.goal("ROOM")
    lines = str(run).splitlines()
    assert [line.split(" (")[0] for line in lines[:4]] == ["HOUSE", "└─ ROOM", "HOUSE#2", "└─ ROOM#2"]


def test_log_of_facts_has_both_lives(recorded: Path, tmp_path: Path):
    run = open_run(recorded)
    log = tmp_path / "run.log"
    convert(run.source, log, "fawkes-log")
    assert [goal.name for goal in open_run(log).goals] == [goal.name for goal in run.goals]


def test_goal_asserted_in_next_mode_is_same_goal(tmp_path: Path):
    (tmp_path / "scenario.yaml").write_text(SCENARIO)
    (tmp_path / "twice.clp").write_text(
        "(defrule begin (executive-initialized) => (assert (goal (id A) (class LOOK))))\n"
        "(defrule on ?g <- (goal (mode FORMULATED)) => (retract ?g)"
        " (assert (goal (id A) (class LOOK) (mode SELECTED))))\n"
        "(defrule end ?g <- (goal (mode SELECTED)) => (retract ?g)"
        " (assert (goal (id A) (class LOOK) (mode RETRACTED) (outcome COMPLETED))))"
    )
    trace = tmp_path / "run.mcap"
    result = run_scenario(RunOptions(scenario=tmp_path, trace=trace, timeout=20.0))
    assert [(goal.goal, goal.outcome) for goal in result.goals] == [("A", "COMPLETED")]
    assert [(goal.name, goal.modes) for goal in open_run(trace).goals] == [
        ("A", ["FORMULATED", "SELECTED", "RETRACTED"])
    ]


@pytest.mark.parametrize("name", ["test-scenario", "workshop"])
def test_result_has_goals_of_recording(name: str, tmp_path: Path):
    """A goal is tried again in the test scenario; the core gives goals their ids in both."""
    scenario, trace = shipped_dir("scenarios") / name, tmp_path / "run.mcap"
    result = run_scenario(RunOptions(scenario=scenario, trace=trace, timeout=60.0))
    goals = [(goal.id, goal.parent, goal.mode, goal.outcome, goal.error) for goal in open_run(trace).goals]
    assert [(goal.goal, goal.parent, goal.mode, goal.outcome, goal.error) for goal in result.goals] == goals
