"""Runs of scenarios with the robot memory."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge.run import RunOptions, run_scenario
from tests.run.mini import write_scenario

AGENT = """
(defrule begin
  (executive-initialized)
  (not (begun))
  =>
  (assert (begun) (goal (id G) (class MINI)))
  (bind ?everything (bson-create))
  (robmem-trigger-register "robmem.test" ?everything "news")
  (bson-destroy ?everything))
(defrule write
  (mutex-trigger-register-feedback SUCCESS "news" ?)
  =>
  (bind ?doc (bson-create))
  (bson-append ?doc "by" agent)
  (robmem-upsert "robmem.test" ?doc "{\\"_id\\": 1}")
  (bson-destroy ?doc))
(defrule read
  ?e <- (robmem-trigger (name "news") (ptr ?doc))
  ?g <- (goal (id G))
  =>
  (printout t "NEWS " (bson-tostring ?doc) crlf)
  (bson-destroy ?doc)
  (retract ?e)
  (modify ?g (mode RETRACTED) (outcome COMPLETED)))
"""
FILE = "\ncxbridge:\n  robot-memory:\n    file: memory.db\n"


def run(folder):
    lines: list[Any] = []
    result = run_scenario(RunOptions(scenario=folder, skiller="none", timeout=20), console=lines.append)
    return result, [line.text for line in lines if line.text.startswith("NEWS")]


def scenario(folder, more=""):
    write_scenario(folder, feature="robot_memory", agent=AGENT)
    with (folder / "scenario.yaml").open("a") as file:
        file.write(more)
    return folder


def test_run_gets_events_of_its_writes_and_repeats(tmp_path):
    folder = scenario(tmp_path)
    result, lines = run(folder)
    assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
    assert '"operationType" : "insert"' in lines[0]
    assert '"fullDocument" : { "_id" : 1, "by" : "agent" }' in lines[0]
    assert run(folder)[1] == lines


def test_rule_requests_robot_memory(tmp_path):
    request = """(defrule request (executive-initialized) => (ff-feature-request "robot_memory")
      (path-load* "later.clp"))"""
    write_scenario(tmp_path, agent=request)
    (tmp_path / "later.clp").write_text(AGENT)
    result, lines = run(tmp_path)
    assert (result.status, len(lines)) == (0, 1)


def test_next_run_has_documents_of_file(tmp_path):
    folder = scenario(tmp_path, FILE)
    assert run(folder)[0].status == 0
    # without a change there is no event
    result, lines = run(folder)
    assert (result.status, lines) == (3, [])


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("\ncxbridge:\n  robot-memory:\n    backend: sqlite\n", "cannot be 'sqlite'"),
        (
            "\ncxbridge:\n  robot-memory:\n    file: scenario.yaml\n",
            "cannot open the robot memory",
        ),
        ("\nplugins:\n  robot-memory:\n    distributed-db-names: 5\n", "distributed-db-names"),
    ],
)
def test_configuration_errors_are_reported(tmp_path, more, message):
    with pytest.raises(CxbridgeError, match=message):
        run(scenario(tmp_path, more))


def test_agent_module_imports_no_mongodb_driver():
    program = "import sys, cxbridge.run.agent; print(*sys.modules)"
    process = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert {"bson", "pymongo"} & set(process.stdout.split()) == set()


@pytest.mark.parametrize("waits", [True, False])
def test_agent_that_waits_for_robot_memory_opens_it(tmp_path, waits):
    write_scenario(tmp_path, agent="(defrule r (executive-initialized) => (printout t NEWS crlf))")
    file = tmp_path / "scenario.yaml"
    entry = 'stage-2: [{name: wait, files: ["BATCH|robmem-wait-init.clp"]}]\n        ' if waits else ""
    file.write_text(file.read_text().replace("stage-3:", f"{entry}stage-3:") + FILE)
    assert run(tmp_path)[1] == ["NEWS"]
    assert (tmp_path / "memory.db").exists() == waits
