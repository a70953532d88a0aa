"""Processes of an exploration die at any moment, and nothing is lost."""

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
from explore_tests.sessions import assert_ended, others_of_session
from explore_tests.test_explore import counts, explored
from tests.forked import nursery

KILLS = 8


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_what_is_killed_is_run_again(tmp_path: Path):
    scenario = write_retrying(tmp_path / "retrying", tries=4)
    words = [str(scenario), "--faults", "3", "--jobs", "2", "--no-merge"]
    whole = counts(explored(*words))
    assert whole["runs"] > 50
    chosen = random.Random(17)
    process, stdin, stdout, stderr = nursery().begin(["explore", *words, "--json"], session=True)
    with process, stdin, stdout, stderr:
        killed = 0
        while process.is_running:
            time.sleep(0.05)
            found = sorted(others_of_session(process.number))
            if len(found) > 1 and killed < KILLS and chosen.random() < 0.3:
                with suppress(ProcessLookupError):
                    os.kill(chosen.choice(found), signal.SIGKILL)
                    killed += 1
        text = stdout.read()
    assert killed > 3
    assert counts(json.loads(text)) == whole
    assert_ended(process.number)
