"""A game with the agent, the robots, the machines and the referee of the module `league`."""

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


def test_game_ends_with_points_machines_robots_and_orders(options):
    result = options.play(3)
    assert result.faults == ()
    assert result.is_over
    document = result.as_dict()
    assert document["points"] == {"CYAN": 5, "MAGENTA": 0}
    assert document["phase"] == "POST_GAME"
    assert document["deliveries"] == [{"order": 1, "complexity": "C0", "team": "CYAN", "game_time": 1.0}]
    assert [award["reason"] for award in document["awards"]] == ["Taken at C-BS"]
    assert 15 < document["robots"]["robot1"]["busy_seconds"] < 60
    assert document["seed"] == 3
    assert document["categories"] == {"CYAN": {"Taken": 5}, "MAGENTA": {}}
    assert document["orders"] == [{"order": 1, "complexity": "C0", "begin": 0, "end": 60, "delivered": [1.0]}]
    use = document["machines"]["C-BS"]
    assert set(use) == {"IDLE", "READY-AT-OUTPUT"}
    assert sum(use.values()) == pytest.approx(60, abs=0.3)
    robot = document["robots"]["robot1"]
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
def test_award_category_comes_from_reason(reason, category):
    assert find_award_category(reason) == category


def test_games_with_equal_seed_are_equal(options, tmp_path):
    texts = []
    for number in range(2):
        log = tmp_path / f"{number}.log"
        replace(options, run_options=replace(options.run_options, log=log)).play(3)
        texts.append(log.read_text())
    assert texts[0] == texts[1]
    assert "manipulate_wp of robot1 SUCCEEDED" in texts[0]


def test_skills_fail_with_given_probability(options):
    result = replace(options, failures=1.0).play(3)
    assert result.score.points["CYAN"] == 0
    assert result.as_dict()["robots"]["robot1"]["failed"] == {"a randomly drawn failure": 1}


def test_world_defines_failures(options, tmp_path):
    world = tmp_path / "world.yaml"
    world.write_text("skills: [{name: moveto, fails: [{error: blocked, after: 7, probability: 1.0}]}]\n")
    result = replace(options, world=world).play(3)
    assert result.robots["robot1"].failed == {"blocked": 1}


def test_configuration_overrides_that_of_referee(options, tmp_path):
    override = tmp_path / "more.yaml"
    override.write_text("llsfrb: {comm: {server-port: 0}}\n")
    assert (
        not replace(options, referee_config=(override,)).play(3).is_over
    )  # no client can instruct the referee


def test_wrong_key_is_logged_once_and_messages_are_lost(options):
    agent = options.run_options.overlays[0] / "src/clips-specs/team.clp"
    peer = 'pb-peer-create-local-crypto "y" 4445 4444 "wrong" "aes-128-cbc"'
    agent.write_text(agent.read_text().replace('pb-peer-create-local "y" 4445 4444', peer))
    events: list[Event] = []
    result = options.play(3, events.append)
    assert result.is_over
    assert result.score.points["CYAN"] == 0
    lines = [event for event in events if isinstance(event, LogLine) and event.level is Level.WARN]
    texts = [line.text for line in lines if "a different key" in line.text]
    assert texts == [
        "Messages to port 4444 have a different key or none: peer 1 of this process cannot read them"
    ]


def test_recording_of_aborted_game_is_complete(options, tmp_path, capsys):
    trace = tmp_path / "game.mcap"
    running = replace(options, run_options=replace(options.run_options, trace=trace), minutes=1000)

    def abort_at_30_s(assembly):
        end_us = assembly.clock.now_us() + 30_000_000

        def check():
            if assembly.clock.now_us() >= end_us and not aborted_at:
                aborted_at.append(assembly.clock.now_us())
                signal.raise_signal(signal.SIGTERM)

        assembly.loop.add(Hook.POST_LOOP, check)

    aborted_at: list[int] = []
    with pytest.raises(KeyboardInterrupt):
        running.play(3, None, abort_at_30_s)
    assert invoke(["trace", "info", str(trace)]) == 0
    out, err = capsys.readouterr()
    assert "not over, in PRODUCTION" in out
    assert "cut off" not in out + err


@pytest.mark.parametrize(
    ("break_checkout", "message"),
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
def test_incomplete_checkout_is_error(options, break_checkout, message):
    break_checkout(options)
    with pytest.raises(CxbridgeError, match=message):
        options.play(3)
