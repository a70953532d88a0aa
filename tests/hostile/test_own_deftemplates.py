"""An agent's deftemplate with a name that cxbridge reads, but different slots, is no fault of cxbridge."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cxbridge.cli.main import invoke
from tests.support import module_files, share

FAULT = 4
"""The exit status after an error in cxbridge itself."""

READ_BY_NAME = re.compile(r"""\b(?:facts|columns|follow\w*)\(\s*"([a-z-]+)\"""")
NAMES = sorted(
    {name for file in module_files().values() for name in READ_BY_NAME.findall(file.read_text("utf-8"))}
)
AGENT = """
(deftemplate {name} (slot of-another-program))
(defrule assert-it (executive-initialized) => (assert ({name} (of-another-program 1))))
"""


def test_names_of_deftemplates_are_found() -> None:
    assert {"goal", "plan-action", "planner-call"} <= {*NAMES}


@pytest.mark.parametrize("name", share(NAMES, 6))
def test_run_with_own_deftemplate_ends_without_fault(tmp_path: Path, name: str) -> None:
    agent = tmp_path / "agent.clp"
    agent.write_text(AGENT.format(name=name), "utf-8")
    status = invoke(["run", str(agent), "--timeout", "2", "--trace", str(tmp_path / "run.mcap")])
    assert status != FAULT
