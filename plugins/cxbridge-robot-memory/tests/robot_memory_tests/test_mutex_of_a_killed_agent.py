"""Two agents in separate processes with a database: the agent with the mutex is killed."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("pymongo", reason="needs pymongo")

from cxbridge.run import RunOptions, run_scenario
from robot_memory_tests.mongo_server import MongoServer
from tests.programs import Started

SCENARIO = """
clips-executive:
  assert-time-each-loop: true
  automatic-goal-retraction: true
  spec: agent
  specs:
    agent:
      parameters:
        coordination:
          mutex: {renew-interval: 0.3, max-age-sec: 1.5}
      init:
        stage-1:
          - name: robot_memory
          - name: wait
            feature-request: false
            files: ["BATCH|robmem-wait-init.clp"]
            wait-for: robmem-initialized
        stage-3:
          - name: agent
            files: [coordination-mutex.clp, agent.clp]
cxbridge:
  robot-memory: {backend: mongodb, uri: "URI"}
"""

AGENT = """
(defrule begin
  (executive-initialized)
  (not (begun))
  =>
  (assert (begun) (goal (id G) (class HOLD)))
  (cx-identity-set "NAME")
  (mutex-try-lock-async m))
(defrule acquired
  ?m <- (mutex (name m) (request LOCK) (response ACQUIRED))
  ?g <- (goal (id G))
  =>
  (printout warn "ACQUIRED" crlf)
  (modify ?m (request NONE) (response NONE))
  (if (eq "NAME" "heir") then (modify ?g (mode RETRACTED) (outcome COMPLETED))))
(defrule refused
  ?m <- (mutex (name m) (request LOCK) (response REJECTED|ERROR))
  =>
  (modify ?m (request NONE) (response NONE)))
(defrule look-for-old-locks
  (time $?now)
  (mutex (name m) (state LOCKED) (locked-by ~"NAME") (request NONE))
  (not (mutex-expire-task))
  =>
  (mutex-expire-locks-async))
(defrule looked
  ?t <- (mutex-expire-task (state COMPLETED|FAILED))
  =>
  (retract ?t))
(defrule try-again
  (mutex (name m) (state OPEN) (request NONE))
  =>
  (mutex-try-lock-async m))
"""


def write(folder: Path, name: str, uri: str) -> Path:
    folder.mkdir()
    (folder / "scenario.yaml").write_text(SCENARIO.replace("URI", uri))
    (folder / "agent.clp").write_text(AGENT.replace("NAME", name))
    return folder


def owner(server: MongoServer) -> str:
    (mutex,) = server.store.find("robmem_coordination.mutex")
    return str(mutex.get("locked-by"))


def test_heir_gets_mutex_only_after_kill_of_holder(tmp_path: Path) -> None:
    with MongoServer() as server:
        holder = write(tmp_path / "holder", "holder", server.uri)
        heir = write(tmp_path / "heir", "heir", server.uri)
        command = ["run", "-v", str(holder), *["--clock", "real", "--skiller", "none", "--timeout", "60"]]
        with Started(*command, stderr=subprocess.STDOUT) as run:
            assert any("ACQUIRED" in line for line in run.stdout)
            options: dict[str, Any] = {"scenario": heir, "clock": "real", "skiller": "none"}
            patient = run_scenario(RunOptions(**options, timeout=3))
            assert patient.status == 3  # the holder lives and renews its lock
            assert owner(server) == "holder"
            run.kill()
        result = run_scenario(RunOptions(**options, timeout=60))
        assert (result.status, result.reason) == (0, "every root goal ended COMPLETED")
        assert owner(server) == "heir"
