"""A run of a shipped scenario depends on its seed only: two runs in processes of their own are equal."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from tests.support import ROOT

SEED = 11
SEARCHING = {"temporal"}
"""Their planner, Aries, searches with several threads: which of the best plans it finds depends on them."""

SCENARIOS = sorted(
    {folder.parent.name for folder in (ROOT / "scenarios").glob("*/scenario.yaml")} - SEARCHING
)
PLAY = """
import json, sys
from pathlib import Path
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.run.options import RunOptions
from cxbridge.worlds.points import RandomChooser
from cxbridge.worlds.run import WorldRun

events = []
options = RunOptions(scenario=Path(sys.argv[1]), skiller="none", timeout=300.0)
with WorldRun(options, RandomChooser(int(sys.argv[2]))) as run:
    run.assembly.bus.subscribe(events.append, *TRANSITION_TYPES)
    result = run.play()
json.dump({"over": result.is_over, "choices": [c.as_dict() for c in result.choices],
           "events": [repr(e) for e in events]}, sys.stdout)
"""


def played(name: str, hash_seed: str) -> dict[str, object]:
    found: dict[str, object] = json.loads(
        subprocess.run(
            [sys.executable, "-c", PLAY, str(ROOT / "scenarios" / name), str(SEED)],
            env={**os.environ, "PYTHONHASHSEED": hash_seed},
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
        ).stdout
    )
    return found


@pytest.mark.parametrize("name", SCENARIOS)
def test_one_seed_is_one_run(name):
    one, other = played(name, "1"), played(name, "2")
    assert one["choices"], "the world was asked"
    assert one == other
