"""Games with the referee and an agent of the league from their checkouts."""

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
    """A folder with a correction of the agent's rule that CLIPS refuses, as in the manual."""
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
    process = subprocess.run(
        [sys.executable, "-m", "cxbridge", *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONHASHSEED": hash_seed},
    )
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout), process.stderr


def test_games_with_equal_seed_are_equal(corrections, tmp_path):
    games = []
    for number in range(2):
        log = tmp_path / f"{number}.log"
        game, errors = play(corrections, "--minutes", "1.5", "--log", log, hash_seed=str(number))
        game.pop("wall_seconds")
        games.append((game, errors, log.read_bytes()))
    assert games[0] == games[1]


def test_agent_scores_points(corrections):
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


def test_undefined_rule_is_reported(corrections):
    game, errors = play(corrections, "--minutes", "0.5", is_corrected=False)
    assert any("defrule exp-sync-zone-content is not defined" in each for each in game["undefined"])
    assert "exp-sync-zone-content" in errors


def test_three_executives_score_points(tmp_path):
    (tmp_path / "referee.yaml").write_text(EXPLORATION)
    game, _ = play(tmp_path, "--minutes", "4", "--spec", "rcll", is_corrected=False)
    assert game["complete"]
    assert game["faults"] == []
    assert game["points"]["CYAN"] > 0
    assert set(game["robots"]) == {"Icks", "Upsilan", "Set"}
    assert all(work["busy_seconds"] > 60 for work in game["robots"].values())


def test_simulation_test_of_agent_succeeds(corrections):
    game, _ = play(corrections, "--minutes", "4", "--simtest", "ENTER-FIELD")
    assert game["simtest"] == "SUCCEEDED"
    assert game["game_time"] < 30
