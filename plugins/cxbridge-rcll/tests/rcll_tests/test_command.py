"""The output and the exit status of the command `game`."""

from __future__ import annotations

import json

import pytest

from cxbridge.cli.main import invoke
from rcll_tests.league import write_refbox, write_team


@pytest.fixture
def words(tmp_path):
    team, refbox = write_team(tmp_path / "team"), write_refbox(tmp_path / "refbox")
    return ["game", "--overlay", str(team), "--refbox-dir", str(refbox), "--minutes", "1", "--seed", "5"]


def test_game_prints_json(words, capsys):
    assert invoke([*words, "--json"]) == 0
    out, err = capsys.readouterr()
    result = json.loads(out)
    assert result.keys() >= {"points", "deliveries", "phase", "game_time", "wall_seconds", "seed"}
    assert (result["points"], result["phase"], result["seed"]) == ({"CYAN": 5, "MAGENTA": 0}, "POST_GAME", 5)
    assert "team.clp:" in err
    assert "defrule team-broken is not defined" in err
    assert "its actions never run" in err


def test_unfinished_game_has_status_3(words, tmp_path, capsys):
    init = tmp_path / "refbox/src/games/rcll/init.clp"
    init.write_text(init.read_text().replace("(rcvd-via STREAM)", "(rcvd-via BROADCAST)"))
    assert invoke(words) == 3
    assert "the game is not over, in PRE_GAME" in capsys.readouterr().out


def test_recording_has_points(words, tmp_path, capsys):
    trace = tmp_path / "game.mcap"
    assert invoke([*words, "--trace", str(trace)]) == 0
    assert invoke(["trace", "info", str(trace)]) == 0
    assert "points: " in capsys.readouterr().out


def test_comparison_plays_equal_seeds(words, tmp_path, capsys):
    """The second agent is an overlay of the first agent's checkout."""
    team = tmp_path / "team"
    overlay = tmp_path / "overlay"
    agent = next(path for path in team.rglob("*.clp") if "team-broken" in path.read_text())
    changed = overlay / agent.relative_to(team)
    changed.parent.mkdir(parents=True)
    changed.write_text(";")
    assert invoke([*words, "--against", str(overlay), "--games", "2", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert [each["by_seed"] for each in result["agents"].values()] == [{"5": 5, "6": 5}, {"5": 0, "6": 0}]
    assert result["comparison"]["better"] is None  # two games are too few for a proof


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--refbox-dir", "/nowhere"], "this is not a checkout of the referee box"),
        (["--overlay", "/nowhere"], "there is no such folder"),
        (["--spec", "tam"], "it has: team"),
        (["--world", "w.yaml"], "w.yaml: "),
        (["--world", "w.yaml", "--failures", "0.5"], "--world and --failures both define the failures"),
        (["--against", "/nowhere"], "there is no such folder"),
    ],
)
def test_invalid_arguments_have_status_2(words, capsys, more, message):
    assert invoke([*words, *more]) == 2
    assert message in capsys.readouterr().err


def test_option_of_league_is_refused_for_workshop(capsys):
    assert invoke(["game", "workshop", "--failures", "0.5"]) == 2
    assert "--failures applies only to games of the league" in capsys.readouterr().err


def test_game_without_agent_has_status_2(words, capsys):
    assert invoke(["game", *words[3:]]) == 2
    assert "no agent is named" in capsys.readouterr().err
