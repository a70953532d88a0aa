"""The exploration of each seeded defect, and the written counterexample."""

from __future__ import annotations

import shutil
from itertools import islice
from pathlib import Path

import pytest

from cxbridge_explore.counterexample import write_counterexample
from explore_tests.defects.seeded import DEFECTS, Defect, play_runs
from explore_tests.pytest_files import run_pytest
from tests.support import ROOT, many, scenarios_of_installed_plugins, share

SHIPPED = ROOT / "scenarios"
INSTALLED = [
    defect
    for defect in DEFECTS
    if defect.folder.parent != SHIPPED or defect.folder in scenarios_of_installed_plugins()
]
EACH_DEFECT = pytest.mark.parametrize(
    "defect", share(INSTALLED, 1), ids=lambda defect: defect.name.replace(" ", "-")
)


@EACH_DEFECT
def test_exploration_finds_defect_and_writes_failing_test(
    defect: Defect, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    agent = defect.copy(tmp_path / "agent", broken=True)
    options = defect.options(agent)
    shortest = next(
        path
        for path, played in play_runs(options, defect.properties, defect.faults)
        if defect.found_by in {violation.property for violation in played.violations}
    )
    assert len(shortest) == defect.faults  # runs with fewer faults come first

    example = write_counterexample(options, defect.properties, defect.found_by, shortest, tmp_path / "found")
    assert len(example.choices) == defect.faults
    assert example.recording.stat().st_size > 0
    assert " fails at " in example.description
    assert example.test is not None
    failed = run_pytest(example.test, monkeypatch)
    output = failed.stdout.decode()
    assert failed.returncode == 1, output
    assert f"{defect.found_by} is violated" in output

    shutil.rmtree(agent)
    defect.copy(agent, broken=False)
    corrected = run_pytest(example.test, monkeypatch)
    assert corrected.returncode == 0, corrected.stdout.decode()


@EACH_DEFECT
def test_correct_agent_violates_no_property(defect: Defect, tmp_path: Path):
    options = defect.options(defect.copy(tmp_path / "agent", broken=False))
    for path, played in islice(play_runs(options, defect.properties, 1), many(100_000, 4)):
        assert played.violations == (), path
