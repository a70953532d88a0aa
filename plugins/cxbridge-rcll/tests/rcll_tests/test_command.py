"""The command: its output, its exit status."""

from __future__ import annotations

import json

import pytest

from cxbridge.cli.main import invoke
from rcll_tests.league import write_refbox, write_team


@pytest.fixture
def words(tmp_path):
    team, refbox = write_team(tmp_path / "team"), write_refbox(tmp_path / "refbox")
    return ["game", "--overlay", str(team), "--refbox-dir", str(refbox), "--minutes", "1", "--seed", "5"]


def test_the_object_for_scripts(words, capsys):
    assert invoke([*words, "--json"]) == 0
    out, err = capsys.readouterr()
    found = json.loads(out)
    assert found.keys() >= {"points", "deliveries", "phase", "game_time", "wall_seconds", "seed"}
    assert (found["points"], found["phase"], found["seed"]) == ({"CYAN": 5, "MAGENTA": 0}, "POST_GAME", 5)
    assert "team.clp:" in err
    assert "defrule team-broken is not defined" in err
    assert "its actions never run" in err


def test_a_game_without_end(words, tmp_path, capsys):
    init = tmp_path / "refbox/src/games/rcll/init.clp"
    init.write_text(init.read_text().replace("(rcvd-via STREAM)", "(rcvd-via BROADCAST)"))
    assert invoke(words) == 3
    assert "the game is not over, in PRE_GAME" in capsys.readouterr().out


def test_a_recording(words, tmp_path, capsys):
    trace = tmp_path / "game.mcap"
    assert invoke([*words, "--trace", str(trace)]) == 0
    assert invoke(["trace", "info", str(trace)]) == 0
    assert "points: " in capsys.readouterr().out


def test_two_agents_on_the_same_seeds(words, tmp_path, capsys):
    """The second agent is a folder that is laid over the checkout of the first agent."""
    team = tmp_path / "team"
    lazy = tmp_path / "lazy"
    agent = next(path for path in team.rglob("*.clp") if "team-broken" in path.read_text())
    changed = lazy / agent.relative_to(team)
    changed.parent.mkdir(parents=True)
    changed.write_text(";")
    assert invoke([*words, "--against", str(lazy), "--games", "2", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [each["by_seed"] for each in found["agents"].values()] == [{"5": 5, "6": 5}, {"5": 0, "6": 0}]
    assert found["comparison"]["better"] is None  # two games prove nothing


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
def test_mistakes(words, capsys, more, message):
    assert invoke([*words, *more]) == 2
    assert message in capsys.readouterr().err


def test_an_option_of_the_league_without_a_referee(capsys):
    assert invoke(["game", "workshop", "--failures", "0.5"]) == 2
    assert "--failures applies only to games of the league" in capsys.readouterr().err


def test_no_agent(words, capsys):
    assert invoke(["game", *words[3:]]) == 2
    assert "no agent is named" in capsys.readouterr().err
