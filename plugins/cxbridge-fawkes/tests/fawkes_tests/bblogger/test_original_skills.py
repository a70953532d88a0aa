"""Fawkes' Lua skills in Fawkes' test scenario."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.run import RunOptions, run_scenario
from fawkes_tests.bblogger.test_run_bblog import DEBUG, SKILLER, SPEECH, STAMP, blocks, recorded, zero_fields
from tests.support import FAWKES_DIR, needs_fawkes, needs_shared

pytestmark = [needs_fawkes, needs_shared]

RUNS = ["skiller-1", "skiller-2"]


@pytest.fixture(scope="module")
def log_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The blackboard's log of a run with all files from the checkout."""
    folder = tmp_path_factory.mktemp("bblog")
    assert FAWKES_DIR is not None
    assert run_scenario(RunOptions(fawkes_dir=FAWKES_DIR, spec="test", bblog=folder)).status == 0
    return folder


@pytest.mark.parametrize(
    ("kind", "fields", "greetings"),
    [(SKILLER, ("exclusive_controller",), 0), (DEBUG, (), 0), (SPEECH, ("duration",), 2)],
)
@pytest.mark.parametrize("run", RUNS)
def test_original_skills_write_recorded_blocks(
    log_folder: Path, run: str, kind: str, fields: tuple[str, ...], greetings: int
) -> None:
    """The recorded speech synthesis starts with a greeting."""
    interface = kind.partition("-")[0]
    written, expected = (
        [zero_fields(interface, block, *fields) for block in blocks(path)]
        for path in (log_folder / f"test-{kind}-{STAMP}.log", recorded(run, kind))
    )
    assert len(written) > 5
    assert written == expected[greetings:]
