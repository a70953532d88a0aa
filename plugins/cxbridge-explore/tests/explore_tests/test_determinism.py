"""An agent that does not decide the same each time is refused, with the first difference and its cause."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from explore_tests.retrying import write_retrying
from tests.forked import nursery
from tests.support import ROOT


def refused(scenario: Path, *words: str) -> str:
    done = nursery().run(["explore", str(scenario), *words])
    said = done.stderr.decode()
    assert done.returncode == 2, done.stdout.decode() + said
    assert "Traceback" not in said
    return said


@pytest.mark.parametrize("means", ["--fork", "--no-fork"])
def test_the_time_of_day_is_found_out(tmp_path: Path, means: str):
    scenario = write_retrying(tmp_path / "agent")
    agent = scenario / "mini.clp"
    # CLIPS' own time: not that of the run's clock
    agent.write_text(agent.read_text().replace("(str-cat ?number)", "(str-cat ?number at (time))"))
    said = refused(scenario, means)
    assert "is not deterministic" in said
    assert "the first difference of two runs is" in said


def test_random_numbers_without_a_seed_are_found_out(tmp_path: Path):
    scenario = tmp_path / "two-robots"
    shutil.copytree(ROOT / "scenarios" / "two-robots", scenario)
    camera = scenario / "camera.py"
    text = camera.read_text().replace('self.setting("seconds", 2.0)', "random.uniform(1, 3)")
    camera.write_text(text.replace("from cxbridge.clock", "import random\n\nfrom cxbridge.clock"))
    said = refused(scenario, "--faults", "0")
    assert "is not deterministic" in said
