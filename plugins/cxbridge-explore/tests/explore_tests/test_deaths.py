"""An exploration whose processes are killed."""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from explore_tests.retrying import write_retrying
from explore_tests.sessions import assert_ended, session_members
from explore_tests.test_explore import run_explore, without_times
from tests.forked import nursery

KILLS = 8


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
def test_exploration_repeats_killed_runs(tmp_path: Path):
    scenario = write_retrying(tmp_path / "retrying", tries=4)
    words = [str(scenario), "--faults", "3", "--jobs", "2", "--no-merge"]
    expected = without_times(run_explore(*words))
    assert expected["runs"] > 50
    rng = random.Random(17)
    process, stdin, stdout, stderr = nursery().begin(["explore", *words, "--json"], session=True)
    with process, stdin, stdout, stderr:
        killed = 0
        while process.is_running:
            time.sleep(0.05)
            members = sorted(session_members(process.number))
            if len(members) > 1 and killed < KILLS and rng.random() < 0.3:
                with suppress(ProcessLookupError):
                    os.kill(rng.choice(members), signal.SIGKILL)
                    killed += 1
        text = stdout.read()
    assert killed > 3
    assert without_times(json.loads(text)) == expected
    assert_ended(process.number)
