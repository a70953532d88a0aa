"""Games with a referee box that runs elsewhere."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from socket import SOCK_DGRAM

import pytest

from cxbridge.cli.main import invoke
from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, LogLine
from cxbridge.run.options import RunOptions
from cxbridge_rcll import remote
from cxbridge_rcll.game import LeagueGame
from cxbridge_rcll.remote import Address
from rcll_tests.league import AGENT, write_team
from rcll_tests.referee_box import message_types, referee_box, write_messages
from tests.support import free_port

FAST = 40.0


@pytest.fixture
def types(tmp_path):
    return message_types(tmp_path / "messages")


@pytest.fixture
def game(tmp_path):
    ports = f"{free_port(SOCK_DGRAM)} {free_port(SOCK_DGRAM)}"
    run = RunOptions(overlays=(write_team(tmp_path / "team", AGENT.replace("4445 4444", ports)),))
    messages = write_messages(tmp_path / "messages")
    return LeagueGame(
        run_options=run, referee=Address("localhost", 1), proto_dirs=(messages,), minutes=0.2, speed=FAST
    )


def at(game, box):
    return replace(game, referee=Address("127.0.0.1", box.port))


def test_a_game_comes_to_its_end_with_the_points_of_the_referee(game, types):
    with referee_box(types, FAST) as box:
        found = at(game, box).play(3)
        assert box.phase == "POST_GAME"
    assert found.is_over
    assert found.faults == ()
    assert found.score.points == {"CYAN": 5, "MAGENTA": 0}
    assert [each.order for each in found.score.deliveries] == [7]
    told = found.as_dict()
    assert told["categories"]["CYAN"] == {"unknown": 5}
    (order,) = told["orders"]
    assert (order["order"], order["complexity"], order["begin"], order["end"]) == (7, "C1", 30, 90)
    assert len(order["delivered"]) == 1
    assert set(told["machines"]["C-BS"]) <= {"IDLE", "READY-AT-OUTPUT"}


def test_the_command(game, types, tmp_path, capsys):
    with referee_box(types, FAST) as box:
        words = ["--referee", f"localhost:{box.port}", "--speed", str(FAST), "--minutes", "0.2"]
        words += ["--overlay", str(tmp_path / "team"), "--proto-dir", str(tmp_path / "messages")]
        assert invoke(["game", *words]) == 0
    assert "CYAN 5, MAGENTA 0; 1 deliveries; the game is over" in capsys.readouterr().out


def test_a_referee_that_is_gone_ends_the_game_and_the_recording_is_whole(game, types, tmp_path, capsys):
    trace = tmp_path / "game.mcap"
    playing = replace(game, run_options=replace(game.run_options, trace=trace), minutes=100)
    with referee_box(types, FAST) as box:

        def kill():
            while box.rounds < 10:
                time.sleep(0.01)
            box.close()

        thread = threading.Thread(target=kill)
        thread.start()
        found = at(playing, box).play(3)
        thread.join()
    assert not found.is_over
    (fault,) = found.faults
    assert f"the referee at 127.0.0.1:{box.port} has disconnected, in PRODUCTION" in fault
    assert found.score.points["CYAN"] == 5
    assert invoke(["trace", "info", str(trace)]) == 0
    out, err = capsys.readouterr()
    assert "has disconnected, in PRODUCTION" in out
    assert "cut off" not in out + err


def test_nobody_is_there(game):
    with pytest.raises(CxbridgeError, match=r"there is no referee at localhost:.* Cannot connect"):
        replace(game, referee=Address("localhost", free_port())).play(3)


def test_a_server_that_says_nothing(game, types, monkeypatch):
    monkeypatch.setattr(remote, "_FIRST_STATE_TIMEOUT_S", 0.3)
    with referee_box(types) as box:
        box.is_silent = True
        with pytest.raises(CxbridgeError, match="has not reported the state of its game"):
            at(game, box).play(3)


def test_messages_of_another_version(game, types, tmp_path, monkeypatch):
    monkeypatch.setattr(remote, "_FIRST_STATE_TIMEOUT_S", 0.3)
    proto = tmp_path / "messages/league.proto"
    proto.write_text(proto.read_text().replace("required State state = 3;", "required string mode = 9;"))
    with referee_box(types) as box, pytest.raises(CxbridgeError, match="message 2000:4: Failed to parse"):
        at(game, box).play(3)


def test_a_referee_whose_game_has_begun(game, types):
    with referee_box(types) as box:
        box.phase = "PRODUCTION"
        with pytest.raises(CxbridgeError, match="has begun: it is in PRODUCTION"):
            at(game, box).play(3)


def test_another_speed_is_told(game, types, monkeypatch):
    monkeypatch.setattr(remote, "_MEASUREMENT_S", 2.0)
    events: list[Event] = []
    with referee_box(types, 4 * FAST) as box:
        at(game, box).play(3, events.append)
    lines = [event.text for event in events if isinstance(event, LogLine)]
    assert any("The referee's time passes" in line and "--speed" in line for line in lines)


def test_an_agent_meets_a_referee_of_this_host_on_this_host(game, types):
    scenario = game.run_options.overlays[0] / "cfg/rcll-simulator/central_agent.yaml"
    text = "    team:\n      parameters: {rcll: {peer-address: 172.16.35.255}}\n"
    scenario.write_text(scenario.read_text().replace("    team:\n", text))
    with referee_box(types, FAST) as box:
        found = []
        at(game, box).play(
            3,
            None,
            lambda agent: found.append(
                agent.config.get_str("/clips-executive/specs/team/parameters/rcll/peer-address")
            ),
        )
    assert found == ["127.0.0.1"]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--referee", "localhost"], "'localhost' is not the address of a referee box"),
        (["--referee", "localhost:70000"], "is not the address"),
        (["--referee", "localhost:4444", "--refbox-dir", "."], "both name the referee"),
        (
            ["--referee", "localhost:4444", "--referee-config", "x.yaml"],
            "--referee-config applies only to --refbox-dir",
        ),
        (["--referee", "localhost:4444", "--games", "2"], "a running referee box plays only one game"),
        (["--refbox-dir", ".", "--speed", "2"], "--speed applies only to --referee"),
        (["--speed", "2"], "--speed applies only to games of the league"),
    ],
)
def test_mistakes(game, capsys, more, message):
    assert invoke(["game", "--overlay", str(game.run_options.overlays[0]), *more]) == 2
    assert message in capsys.readouterr().err


def test_addresses():
    assert Address.parse("[::1]:4444") == Address("::1", 4444)
    assert str(Address.parse("field:4444")) == "field:4444"
