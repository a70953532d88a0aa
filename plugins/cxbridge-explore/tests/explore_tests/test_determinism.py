"""The refusal of nondeterministic agents, with the first difference of two runs."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from explore_tests.retrying import write_retrying
from tests.forked import nursery
from tests.support import ROOT


def explore_refused(scenario: Path, *words: str) -> str:
    process = nursery().run(["explore", str(scenario), *words])
    errors = process.stderr.decode()
    assert process.returncode == 2, process.stdout.decode() + errors
    assert "Traceback" not in errors
    return errors


@pytest.mark.parametrize("means", ["--fork", "--no-fork"])
def test_agent_with_time_of_day_is_refused(tmp_path: Path, means: str):
    scenario = write_retrying(tmp_path / "agent")
    agent = scenario / "mini.clp"
    # the time of CLIPS is not that of the run's clock
    agent.write_text(agent.read_text().replace("(str-cat ?number)", "(str-cat ?number at (time))"))
    errors = explore_refused(scenario, means)
    assert "is not deterministic" in errors
    assert "the first difference of two runs is" in errors


def test_executor_with_unseeded_random_numbers_is_refused(tmp_path: Path):
    scenario = tmp_path / "two-robots"
    shutil.copytree(ROOT / "scenarios" / "two-robots", scenario)
    camera = scenario / "camera.py"
    text = camera.read_text().replace('self.setting("seconds", 2.0)', "random.uniform(1, 3)")
    camera.write_text(text.replace("from cxbridge.clock", "import random\n\nfrom cxbridge.clock"))
    errors = explore_refused(scenario, "--faults", "0")
    assert "is not deterministic" in errors
