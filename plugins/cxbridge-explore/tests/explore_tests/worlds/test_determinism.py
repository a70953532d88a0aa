"""Runs of shipped scenarios with equal seeds are equal."""

from __future__ import annotations

import json
import os
import subprocess
import sys

from tests.support import ROOT, scenarios_of_installed_plugins, share

SEED = 11
SEARCHING = {"temporal"}
"""The planner Aries searches with several threads, which decide between equally good plans."""

SCENARIOS = share(
    sorted({folder.name for folder in scenarios_of_installed_plugins()} - SEARCHING),
    3,
)
PLAY = """
import json, os, sys
from pathlib import Path
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.run.options import RunOptions
from cxbridge_explore.worlds.points import RandomChooser
from cxbridge_explore.worlds.run import WorldRun

def play(name, seed):
    events = []
    options = RunOptions(scenario=Path("scenarios", name), skiller="none", timeout=300.0)
    with WorldRun(options, RandomChooser(seed)) as run:
        run.assembly.bus.subscribe(events.append, *TRANSITION_TYPES)
        result = run.play()
    return {"name": name, "over": result.is_over, "choices": [c.as_dict() for c in result.choices],
            "events": [repr(e) for e in events]}

seed, *names = sys.argv[1:]
for name in names:
    if not (process := os.fork()):
        print(json.dumps(play(name, int(seed))), flush=True)
        os._exit(0)
    assert os.waitpid(process, 0)[1] == 0, name
"""
"""Plays each scenario in a forked process, which does not load the program again."""


def play_scenarios(hash_seed: str) -> list[dict[str, object]]:
    process = subprocess.run(
        [sys.executable, "-c", PLAY, str(SEED), *SCENARIOS],
        env={**os.environ, "PYTHONHASHSEED": hash_seed},
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    return [json.loads(line) for line in process.stdout.splitlines()]


def test_runs_with_equal_seed_are_equal():
    runs_a, runs_b = play_scenarios("1"), play_scenarios("2")
    assert [run["name"] for run in runs_a] == SCENARIOS
    for run_a, run_b in zip(runs_a, runs_b, strict=True):
        assert run_a["choices"], f"the world of {run_a['name']} has no choice"
        assert run_a == run_b
