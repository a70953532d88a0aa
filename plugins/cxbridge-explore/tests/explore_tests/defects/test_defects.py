"""Exploring finds each seeded defect, with a shortest path; its files show the defect to people."""

from __future__ import annotations

import shutil
from itertools import islice
from pathlib import Path

import pytest

from cxbridge_explore.counterexample import write_counterexample
from explore_tests.defects.seeded import DEFECTS, Defect, runs
from explore_tests.pytest_files import pytest_of
from tests.support import ROOT, many, scenarios_of_installed_plugins, share

SHIPPED = ROOT / "scenarios"
INSTALLED = [
    defect
    for defect in DEFECTS
    if defect.folder.parent != SHIPPED or defect.folder in scenarios_of_installed_plugins()
]
EACH = pytest.mark.parametrize("defect", share(INSTALLED, 1), ids=lambda each: each.name.replace(" ", "-"))


@EACH
def test_it_is_found_and_shown(defect: Defect, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    agent = defect.copy(tmp_path / "agent", broken=True)
    options = defect.options(agent)
    found = next(
        path
        for path, played in runs(options, defect.properties, defect.faults)
        if defect.found_by in {violation.property for violation in played.violations}
    )
    assert len(found) == defect.faults  # those with fewer faults came first

    example = write_counterexample(options, defect.properties, defect.found_by, found, tmp_path / "found")
    assert len(example.choices) == defect.faults
    assert example.recording.stat().st_size > 0
    assert " fails at " in example.description
    assert example.test is not None
    failed = pytest_of(example.test, monkeypatch)
    said = failed.stdout.decode()
    assert failed.returncode == 1, said
    assert f"{defect.found_by} is violated" in said

    shutil.rmtree(agent)
    defect.copy(agent, broken=False)
    mended = pytest_of(example.test, monkeypatch)
    assert mended.returncode == 0, mended.stdout.decode()


@EACH
def test_the_agent_without_the_defect_has_the_property(defect: Defect, tmp_path: Path):
    options = defect.options(defect.copy(tmp_path / "agent", broken=False))
    for path, played in islice(runs(options, defect.properties, 1), many(100_000, 4)):
        assert played.violations == (), path
