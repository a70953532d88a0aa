"""The command `cxbridge game` with a game, many games, two agents, and scenarios without a game."""

from __future__ import annotations

import json
import shutil

import pytest

from cxbridge.cli.main import invoke
from cxbridge.trace.formats.registry import open_run
from cxbridge_explore.game.match import Match
from cxbridge_explore.game.score import GameResult, Score
from cxbridge_explore.game.work import covered_seconds
from tests.forked import nursery
from tests.run.mini import write_scenario
from tests.support import ROOT

WORKSHOP = ROOT / "scenarios" / "workshop"


def result(seed: int, points: int) -> GameResult:
    return GameResult(Score({"A": points, "B": 0}, (), (), "POST_GAME", 1.0), True, seed, 1.0, {}, {})


def copy_workshop(folder, length="orders: 2, minutes: 3.0"):
    """Return a copy of the workshop with a few orders and no failures."""
    shutil.copytree(WORKSHOP, folder)
    (folder / "world.yaml").unlink()
    file = folder / "scenario.yaml"
    file.write_text(file.read_text().replace("orders: 8, minutes: 5.0", length))
    return folder


@pytest.fixture
def short(tmp_path):
    """A copy of the workshop with two orders and no failures."""
    return copy_workshop(tmp_path / "short")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The JSON output of a game, and the game's recording."""
    folder = tmp_path_factory.mktemp("recorded")
    trace = folder / "game.mcap"
    words = ["game", str(copy_workshop(folder / "short")), "--seed", "1", "--json", "--trace", str(trace)]
    process = nursery().run(words)
    assert process.returncode == 0, process.stderr.decode()
    return json.loads(process.stdout), trace


def test_game_prints_score_as_json(recorded):
    game, trace = recorded
    assert game["points"] == {"workshop": 70}
    assert [each["complexity"] for each in game["deliveries"]] == ["oak", "ash+red"]
    assert [each["points"] for each in game["awards"]] == [30, 40]
    assert (game["phase"], game["complete"], game["seed"]) == ("POST_GAME", True, 1)
    assert game["robots"]["saw"]["busy_seconds"] == pytest.approx(12.0, abs=0.5)
    assert "points: {'workshop': 70}" in open_run(trace).metadata()["reason"]


def test_game_prints_machines_robots_and_orders(recorded):
    game, _ = recorded
    assert game["categories"] == {"workshop": {"in time": 70}}
    first, second = game["orders"]
    assert (first["order"], first["complexity"], first["delivered"]) == (
        1,
        "oak",
        [game["deliveries"][0]["game_time"]],
    )
    assert first["begin"] < first["delivered"][0] < first["end"]
    assert second["delivered"] == [game["deliveries"][1]["game_time"]]
    use = game["machines"]
    assert list(use) == ["booth", "counter", "saw"]
    assert use["saw"]["busy"] == pytest.approx(12.0, abs=0.5)
    seconds = [sum(states.values()) for states in use.values()]
    assert seconds == pytest.approx([game["game_time"]] * 3, abs=1.5)
    for name in ("robot1", "robot2", "saw"):
        work = game["robots"][name]
        assert work["busy_seconds"] + work["idle_seconds"] == pytest.approx(seconds[0], abs=0.2)


def test_recording_has_outcome(recorded):
    game, trace = recorded
    (attachment,) = (each for each in open_run(trace).attachments() if each.name == "game/outcome.json")
    assert json.loads(attachment.data).items() <= game.items()


def test_game_prints_awards_and_summary(short, capsys):
    assert invoke(["game", str(short), "--seed", "1"]) == 0
    *lines, last = capsys.readouterr().out.splitlines()
    assert any(line.endswith("workshop  +30  oak in time") for line in lines)
    assert last.startswith("workshop 70; 2 deliveries; the game is over after")


def test_comparison_plays_equal_seeds(tmp_path, capsys):
    short, worse = (copy_workshop(tmp_path / name, "orders: 1, minutes: 1.0") for name in ("short", "worse"))
    file = worse / "scenario.yaml"
    file.write_text(file.read_text().replace("speed: 0.5", "speed: 0.1"))
    assert invoke(["game", str(short), "--against", str(worse), "--games", "6", "--seed", "1"]) == 0
    assert capsys.readouterr().out.endswith(f"{short} is better\n")


@pytest.mark.parametrize(("games", "better"), [(1, None), (2, None), (5, None), (6, 1)])
def test_better_agent_needs_several_games(games, better):
    seeds = range(1, games + 1)
    match = Match({seed: result(seed, 10) for seed in seeds}, {seed: result(seed, 11) for seed in seeds})
    assert match.better_index == better
    assert json.loads(json.dumps(match.as_dict(), allow_nan=False))["difference"]["estimate"] == 1


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["MINI"], "this scenario is not a game: its configuration has no /game/seed"),
        (["SHORT", "--against", "SHORT"], "--against names the same agent"),
        (["SHORT", "--games", "2", "--trace", "x.mcap"], "many games cannot be recorded to one file"),
        (["SHORT", "--world", "none.yaml"], "none.yaml"),
        (["SHORT", "--games", "2", "--against", "MINI"], "this scenario is not a game"),
        (["BROKEN"], "/game/seed names 'referee/sed', which the configuration does not have"),
    ],
)
def test_invalid_arguments_have_status_2(arguments, complaint, short, tmp_path, capsys):
    broken = tmp_path / "broken"
    shutil.copytree(short, broken)
    text = (broken / "scenario.yaml").read_text()
    path = "skill-board/agents/counter/executors/referee/seed"
    (broken / "scenario.yaml").write_text(text.replace(f"seed: {path}", "seed: referee/sed"))
    places = {"MINI": write_scenario(tmp_path / "mini"), "SHORT": short, "BROKEN": broken}
    assert invoke(["game", *(str(places.get(each, each)) for each in arguments)]) == 2
    errors = capsys.readouterr().err
    assert complaint in errors
    assert "Traceback" not in errors


def test_game_without_referee_is_error(short, capsys):
    file = short / "machines.py"
    file.write_text(file.read_text().replace('"GameInterface", "Game"', '"HeartbeatInterface", "Game"'))
    assert invoke(["game", str(short)]) != 0
    assert "Traceback" not in capsys.readouterr().err


def test_overlapping_skills_count_once():
    assert covered_seconds([(0, 10), (2, 5), (8, 12), (20, 21)]) == 13
