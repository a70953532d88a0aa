"""A run of a shipped scenario depends on its seed only: two runs in separate processes are equal."""

from __future__ import annotations

import json
import os
import subprocess
import sys

from tests.support import ROOT, scenarios_of_installed_plugins, share

SEED = 11
SEARCHING = {"temporal"}
"""Their planner, Aries, searches with several threads: which of the best plans it finds depends on them."""

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
"""Plays each scenario in a child process, which need not load the program again."""


def played(hash_seed: str) -> list[dict[str, object]]:
    done = subprocess.run(
        [sys.executable, "-c", PLAY, str(SEED), *SCENARIOS],
        env={**os.environ, "PYTHONHASHSEED": hash_seed},
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_one_seed_is_one_run():
    ones, others = played("1"), played("2")
    assert [one["name"] for one in ones] == SCENARIOS
    for one, other in zip(ones, others, strict=True):
        assert one["choices"], f"the world of {one['name']} was asked"
        assert one == other
