"""The check of an agent of the ROS 2 CX executes no code of the agent, in contrast to a run."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from tests.support import needs_plugin

PARAMETERS = """clips_manager:
  ros__parameters:
    environments: [e]
    e: {plugins: [executive, files]}
    executive: {plugin: "cx::ExecutivePlugin"}
    files:
      plugin: "cx::FileLoadPlugin"
      batch: ["{folder}/batch.clp"]
      load: ["{folder}/agent.clp"]
      cleanup_batch: ["{folder}/batch.clp"]
"""
TRAPS = {
    "agent.clp": (
        '(deftemplate g (slot x (default (system "touch {folder}/ran-default"))))'
        '(defglobal ?*a* = (system "touch {folder}/ran-global"))'
        "(deffacts f (g (x 1)))"
        '(defrule r (g) (test (system "touch {folder}/ran-test")) => (system "touch {folder}/ran-rule"))'
    ),
    "batch.clp": '(system "touch {folder}/ran-batch")\n(batch* "{folder}/other.clp")',
    "other.clp": '(system "touch {folder}/ran-other")',
}


@pytest.fixture(name="parameters")
def _parameters(tmp_path: Path) -> Path:
    for name, text in (TRAPS | {"params.yaml": PARAMETERS}).items():
        (tmp_path / name).write_text(text.replace("{folder}", str(tmp_path)))
    return tmp_path / "params.yaml"


def find_sprung_traps(folder: Path) -> set[str]:
    return {file.name.removeprefix("ran-") for file in folder.glob("ran-*")}


@needs_plugin("studio")
def test_check_executes_no_code_of_agent(parameters: Path):
    assert invoke(["check", str(parameters)]) == 0
    assert find_sprung_traps(parameters.parent) == set()
    assert invoke(["run", str(parameters), "--timeout", "2", "--quiet"]) == 0
    assert find_sprung_traps(parameters.parent) == {"default", "global", "test", "rule", "batch", "other"}
