"""The shared databases of the agents of a run, and the databases of each agent."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

from tests.run.test_team import run, write

AGENT = """
(defrule begin
  (executive-initialized)
  (wm-fact (id "/config/agent/name") (value ?me))
  (not (begun))
  =>
  (assert (begun) (goal (id G) (class MINI)))
  (bind ?everything (bson-create))
  (robmem-trigger-register "syncedrobmem.test" ?everything "shared")
  (robmem-trigger-register "robmem.test" ?everything "own")
  (bson-destroy ?everything)
  (bind ?doc (bson-create))
  (bson-append ?doc "by" ?me)
  (robmem-upsert "robmem.test" ?doc (str-cat "{\\"_id\\": \\"" ?me "\\"}"))
  (robmem-upsert "syncedrobmem.test" ?doc (str-cat "{\\"_id\\": \\"" ?me "\\"}"))
  (bson-destroy ?doc))
(defrule heard
  ?event <- (robmem-trigger (name ?name) (ptr ?doc))
  =>
  (printout warn ?name " " (bson-get ?doc "fullDocument.by") crlf)
  (bson-destroy ?doc)
  (retract ?event))
(defrule enough
  (time $?)
  ?goal <- (goal (id G) (mode FORMULATED))
  =>
  (modify ?goal (mode SELECTED)))
(defrule over
  (time $?)
  ?goal <- (goal (id G) (mode SELECTED))
  =>
  (modify ?goal (mode RETRACTED) (outcome COMPLETED)))
"""


def test_only_distributed_databases_are_shared(tmp_path: Path) -> None:
    more = "\ncxbridge: {agents: {ann: {}, ben: {}}, robot-memory: {file: memory.db}}\n"
    result, lines = run(write(tmp_path, more, feature="robot_memory", agent=AGENT), skiller="none")
    assert result.status == 0
    heard = {(line.component, line.text) for line in lines if line.text.startswith(("shared", "own"))}
    ann, ben = "CLIPS (ann)", "CLIPS (ben)"
    assert {(ann, "own ann"), (ben, "own ben"), (ann, "shared ben"), (ben, "shared ben")} <= heard
    assert not heard & {(ann, "own ben"), (ben, "own ann")}
    for file, count in (("memory.db", 2), ("memory-ann.db", 1), ("memory-ben.db", 1)):
        with closing(sqlite3.connect(tmp_path / file)) as database, database:
            assert database.execute("SELECT count(*) FROM documents").fetchone() == (count,)
