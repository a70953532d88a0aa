"""An id that an agent uses for a second goal keeps both lives: in the history, in `why`, on the page."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.history.model import goals_named
from cxbridge.run.options import RunOptions
from cxbridge.run.program.finished import open_run
from cxbridge.run.run import run_scenario
from cxbridge.trace.convert import convert
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.recorded import RecordedEvidence
from tests.history.test_views_agree import NODE, in_page, page_modules

__all__ = ["page_modules"]

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


def test_a_program_sees_both_lives(recorded: Path):
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


def test_a_log_of_facts_says_it_too(recorded: Path, tmp_path: Path):
    run = open_run(recorded)
    log = tmp_path / "run.log"
    convert(run.source, log, "fawkes-log")
    assert [goal.name for goal in open_run(log).goals] == [goal.name for goal in run.goals]


@pytest.mark.parametrize("name", ["ROOM#2", "LOOK#2"])
def test_why_is_asked_by_number(recorded: Path, name: str):
    answer = explain(RecordedEvidence(open_run(recorded).source, None, None), name, "goal")
    assert answer.plain["goals"][0]["goal"] == "ROOM#2"
    assert answer.plain["goals"][0]["outcome"] == "COMPLETED"


def test_why_without_a_number_tells_of_both(recorded: Path):
    answer = explain(RecordedEvidence(open_run(recorded).source, None, None), "ROOM", "goal")
    assert [goal["outcome"] for goal in answer.plain["goals"]] == ["FAILED", "COMPLETED"]


def test_why_is_asked_by_time(recorded: Path):
    run = open_run(recorded)
    for life, name in enumerate(("ROOM", "ROOM#2")):
        end = goals_named(run.goals, "ROOM")[life].changes[-2].time / 1e6
        answer = explain(RecordedEvidence(run.source, end, None), "ROOM", "goal")
        assert [goal["goal"] for goal in answer.plain["goals"]] == [name]


@pytest.mark.skipif(NODE is None, reason="needs node")
def test_the_page_has_both(recorded: Path, page_modules: Path):
    model = in_page(open_run(recorded).source, page_modules)
    assert [(goal["key"], goal["parent"]) for goal in model["goals"]] == [
        ("HOUSE", ""),
        ("ROOM", "HOUSE"),
        ("HOUSE#2", ""),
        ("ROOM#2", "HOUSE#2"),
    ]
    assert {goal["key"]: goal["outcome"] for goal in model["now"]} == {
        "HOUSE": "FAILED",
        "ROOM": "FAILED",
        "HOUSE#2": "COMPLETED",
        "ROOM#2": "COMPLETED",
    }


def test_the_result_of_a_run_lists_both(recorded: Path):
    result = run_scenario(RunOptions(scenario=recorded.parent, timeout=20.0))
    assert [(line.split(":")[0].split(" (")[0], line.rpartition(" ")[2]) for line in result.goal_lines()] == [
        ("HOUSE", "FAILED"),
        ("└─ ROOM", "FAILED"),
        ("HOUSE#2", "COMPLETED"),
        ("└─ ROOM#2", "COMPLETED"),
    ]
