"""A game with the referee of the module `league`: agent, robots, machines and referee meet in one run."""

from __future__ import annotations

import signal
from dataclasses import replace

import pytest

from cxbridge.cli.main import invoke
from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, Level, LogLine
from cxbridge.mainloop import Hook
from cxbridge.run.options import RunOptions
from cxbridge_rcll.game import LeagueGame
from cxbridge_rcll.score import find_award_category
from rcll_tests.league import MESSAGES, write_refbox, write_team


@pytest.fixture
def options(tmp_path):
    run = RunOptions(overlays=(write_team(tmp_path / "team"),))
    return LeagueGame(run_options=run, refbox_dir=write_refbox(tmp_path / "refbox"), minutes=1)


def write_messages(options, text):
    (options.refbox_dir / "src/msgs/rcll-protobuf-msgs/league.proto").write_text(text)


def test_a_game_comes_to_its_end_with_points_machines_robots_and_orders(options):
    result = options.play(3)
    assert result.faults == ()
    assert result.is_over
    found = result.as_dict()
    assert found["points"] == {"CYAN": 5, "MAGENTA": 0}
    assert found["phase"] == "POST_GAME"
    assert found["deliveries"] == [{"order": 1, "complexity": "C0", "team": "CYAN", "game_time": 1.0}]
    assert [award["reason"] for award in found["awards"]] == ["Taken at C-BS"]
    assert 15 < found["robots"]["robot1"]["busy_seconds"] < 60
    assert found["seed"] == 3
    assert found["categories"] == {"CYAN": {"Taken": 5}, "MAGENTA": {}}
    assert found["orders"] == [{"order": 1, "complexity": "C0", "begin": 0, "end": 60, "delivered": [1.0]}]
    use = found["machines"]["C-BS"]
    assert set(use) == {"IDLE", "READY-AT-OUTPUT"}
    assert sum(use.values()) == pytest.approx(60, abs=0.3)
    robot = found["robots"]["robot1"]
    assert robot["busy_seconds"] + robot["idle_seconds"] == pytest.approx(60, abs=0.3)


@pytest.mark.parametrize(
    ("reason", "category"),
    [
        ("Retrieved cap at C-CS1", "Retrieved cap"),
        ("Mounted CC2 ring of CC2 for order 6", "Mounted CC2 ring"),
        ("Mounted cap for order 3 Late (deadline: 200)", "Mounted cap late"),
        ("Added additional base to C-RS1", "Added additional base"),
        ("Delivered item for order 4 (too many)", "Delivered item"),
        ("Late delivery of order (>10% )", "Late delivery"),
        ("SS: Retrieved C0", "SS"),
        ("taken", "taken"),
    ],
)
def test_points_are_grouped_by_what_the_referee_says(reason, category):
    assert find_award_category(reason) == category


def test_one_seed_is_one_game(options, tmp_path):
    texts = []
    for number in range(2):
        log = tmp_path / f"{number}.log"
        replace(options, run_options=replace(options.run_options, log=log)).play(3)
        texts.append(log.read_text())
    assert texts[0] == texts[1]
    assert "manipulate_wp of robot1 SUCCEEDED" in texts[0]


def test_skills_fail_as_likely_as_asked(options):
    result = replace(options, failures=1.0).play(3)
    assert result.score.points["CYAN"] == 0
    assert result.as_dict()["robots"]["robot1"]["failed"] == {"a randomly drawn failure": 1}


def test_a_world_says_what_fails(options, tmp_path):
    world = tmp_path / "world.yaml"
    world.write_text("skills: [{name: moveto, fails: [{error: blocked, after: 7, probability: 1.0}]}]\n")
    result = replace(options, world=world).play(3)
    assert result.robots["robot1"].failed == {"blocked": 1}


def test_a_configuration_is_laid_over_the_referees(options, tmp_path):
    more = tmp_path / "more.yaml"
    more.write_text("llsfrb: {comm: {server-port: 0}}\n")
    assert not replace(options, referee_config=(more,)).play(3).is_over  # no client can instruct the referee


def test_another_key_is_told_once_and_nothing_is_heard(options):
    agent = options.run_options.overlays[0] / "src/clips-specs/team.clp"
    peer = 'pb-peer-create-local-crypto "y" 4445 4444 "wrong" "aes-128-cbc"'
    agent.write_text(agent.read_text().replace('pb-peer-create-local "y" 4445 4444', peer))
    events: list[Event] = []
    result = options.play(3, events.append)
    assert result.is_over
    assert result.score.points["CYAN"] == 0
    lines = [event for event in events if isinstance(event, LogLine) and event.level is Level.WARN]
    told = [line.text for line in lines if "a different key" in line.text]
    assert told == [
        "Messages to port 4444 have a different key or none: no peer of this process can read them"
    ]


def test_the_recording_of_an_aborted_game_is_whole(options, tmp_path, capsys):
    trace = tmp_path / "game.mcap"
    running = replace(options, run_options=replace(options.run_options, trace=trace), minutes=1000)

    def abort_at_30_s(assembly):
        end_us = assembly.clock.now_us() + 30_000_000

        def check():
            if assembly.clock.now_us() >= end_us and not asked:
                asked.append(assembly.clock.now_us())
                signal.raise_signal(signal.SIGTERM)

        assembly.loop.add(Hook.POST_LOOP, check)

    asked: list[int] = []
    with pytest.raises(KeyboardInterrupt):
        running.play(3, None, abort_at_30_s)
    assert invoke(["trace", "info", str(trace)]) == 0
    out, err = capsys.readouterr()
    assert "not over, in PRODUCTION" in out
    assert "cut off" not in out + err


@pytest.mark.parametrize(
    ("break_it", "message"),
    [
        (lambda options: (options.refbox_dir / "src/games/rcll/init.clp").unlink(), "has no src/games/rcll"),
        (
            lambda options: (options.refbox_dir / "src/msgs/rcll-protobuf-msgs/league.proto").unlink(),
            "none of these folders has message definitions",
        ),
        (
            lambda options: write_messages(options, MESSAGES.replace("SetGamePhase", "SetPhase")),
            "the message definitions have no llsf_msgs.SetGamePhase",
        ),
        (
            lambda options: (
                options.run_options.overlays[0] / "cfg/rcll-simulator/central_agent.yaml"
            ).unlink(),
            "there is no such scenario",
        ),
    ],
)
def test_mistakes(options, break_it, message):
    break_it(options)
    with pytest.raises(CxbridgeError, match=message):
        options.play(3)
