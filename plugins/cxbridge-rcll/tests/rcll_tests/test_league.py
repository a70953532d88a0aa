"""The league's own referee and a team's own agent, from their checkouts, in one run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import FAWKES_DIR, ROBOTINO_DIR

REFBOX_DIR = os.environ.get("REFBOX_DIR", "")
"""A checkout of rcll-refbox."""

RCLL_PROTOS = os.environ.get("RCLL_PROTOS", "")
"""A checkout of rcll-protobuf-msgs; not needed when other checkouts have their submodules."""

pytestmark = pytest.mark.skipif(
    not (REFBOX_DIR and FAWKES_DIR and ROBOTINO_DIR),
    reason="REFBOX_DIR, FAWKES_DIR and ROBOTINO_DIR do not all name checkouts",
)

EXPLORATION = "llsfrb: {game: {exploration-time: 20}}\n"
"""A short exploration, so that a short game has a production."""


@pytest.fixture(scope="module")
def corrections(tmp_path_factory):
    """A folder with the file of the agent whose rule CLIPS refuses, corrected as the manual says."""
    assert ROBOTINO_DIR is not None
    name = Path("src/clips-specs/rcll-central/exploration.clp")
    folder = tmp_path_factory.mktemp("corrections")
    (folder / name.parent).mkdir(parents=True)
    text = (ROBOTINO_DIR / name).read_text()
    (folder / name).write_text(text.replace("?team-clor", "?team-color"))
    (folder / "referee.yaml").write_text(EXPLORATION)
    return folder


def play(corrections, *more, hash_seed="0", is_corrected=True):
    """Play in a child process; return its stdout and stderr."""
    overlays = ["--overlay", corrections] if is_corrected else []
    protos = ["--proto-dir", RCLL_PROTOS] if RCLL_PROTOS else []
    words = [
        *("game", *overlays, "--overlay", ROBOTINO_DIR),
        *("--fawkes-dir", FAWKES_DIR, "--refbox-dir", REFBOX_DIR),
        *("--spec", "rcll-central", "--seed", "1", "--json", *protos, *more),
        *("--referee-config", corrections / "referee.yaml"),
    ]
    done = subprocess.run(
        [sys.executable, "-m", "cxbridge", *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONHASHSEED": hash_seed},
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), done.stderr


def test_one_seed_is_one_game(corrections, tmp_path):
    found = []
    for number in range(2):
        log = tmp_path / f"{number}.log"
        game, errors = play(corrections, "--minutes", "1.5", "--log", log, hash_seed=str(number))
        game.pop("wall_seconds")
        found.append((game, errors, log.read_bytes()))
    assert found[0] == found[1]


def test_the_agent_scores(corrections):
    game, _ = play(corrections, "--minutes", "4")
    assert game["complete"]
    assert game["phase"] == "POST_GAME"
    assert game["points"]["CYAN"] > 0
    assert game["points"]["CYAN"] == sum(award["points"] for award in game["awards"])
    assert game["faults"] == []
    assert game["categories"]["CYAN"]["Retrieved cap"] > 0
    assert sum(game["categories"]["CYAN"].values()) == game["points"]["CYAN"]
    assert len(game["machines"]) == 14
    assert all(sum(states.values()) == pytest.approx(240, abs=1) for states in game["machines"].values())
    assert game["machines"]["C-CS1"]["PROCESSING"] > 10
    robots = game["robots"].values()
    assert all(each["busy_seconds"] + each["idle_seconds"] == pytest.approx(240, abs=20) for each in robots)
    assert {each["order"] for each in game["orders"]} >= {1, 2}


def test_the_rule_that_is_not_defined_is_told(corrections):
    game, errors = play(corrections, "--minutes", "0.5", is_corrected=False)
    assert any("defrule exp-sync-zone-content is not defined" in each for each in game["undefined"])
    assert "exp-sync-zone-content" in errors


def test_three_executives_play(tmp_path):
    (tmp_path / "referee.yaml").write_text(EXPLORATION)
    game, _ = play(tmp_path, "--minutes", "4", "--spec", "rcll", is_corrected=False)
    assert game["complete"]
    assert game["faults"] == []
    assert game["points"]["CYAN"] > 0
    assert set(game["robots"]) == {"Icks", "Upsilan", "Set"}
    assert all(work["busy_seconds"] > 60 for work in game["robots"].values())


def test_the_agents_own_tests(corrections):
    game, _ = play(corrections, "--minutes", "4", "--simtest", "ENTER-FIELD")
    assert game["simtest"] == "SUCCEEDED"
    assert game["game_time"] < 30
