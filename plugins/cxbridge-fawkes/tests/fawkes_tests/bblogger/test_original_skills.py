"""The original Lua files in the original test scenario write the recorded blocks."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.run import RunOptions, run_scenario
from fawkes_tests.bblogger.test_run_bblog import DEBUG, SKILLER, SPEECH, STAMP, blocks, recorded, without
from tests.support import FAWKES_DIR, needs_fawkes, needs_shared

pytestmark = [needs_fawkes, needs_shared]

RUNS = ["skiller-1", "skiller-2"]


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The blackboard's log of a run with everything from the checkout."""
    folder = tmp_path_factory.mktemp("bblog")
    assert FAWKES_DIR is not None
    assert run_scenario(RunOptions(fawkes_dir=FAWKES_DIR, spec="test", bblog=folder)).status == 0
    return folder


def both(ours: Path, run: str, kind: str, *fields: str) -> tuple[list[bytes], list[bytes]]:
    """Our blocks and the recorded ones of an interface, without times and these fields."""
    interface = kind.partition("-")[0]
    mine, theirs = (
        [without(interface, block, *fields) for block in blocks(path)]
        for path in (ours / f"test-{kind}-{STAMP}.log", recorded(run, kind))
    )
    return mine, theirs


@pytest.mark.parametrize("run", RUNS)
def test_the_skiller_writes_the_recorded_blocks(ours: Path, run: str) -> None:
    mine, theirs = both(ours, run, SKILLER, "exclusive_controller")
    assert len(mine) > 5
    assert mine == theirs


@pytest.mark.parametrize("run", RUNS)
def test_the_graphs_are_the_recorded_blocks(ours: Path, run: str) -> None:
    mine, theirs = both(ours, run, DEBUG)
    assert len(mine) > 5
    assert mine == theirs


@pytest.mark.parametrize("run", RUNS)
def test_the_speech_synthesis_writes_the_recorded_blocks_after_its_greeting(ours: Path, run: str) -> None:
    mine, theirs = both(ours, run, SPEECH, "duration")
    assert mine == theirs[2:]
