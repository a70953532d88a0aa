"""A running daemon tells why, over its blackboard."""

from __future__ import annotations

import threading

import pytest

from cxbridge.cli.main import invoke
from cxbridge.daemon.client import ask_why, send_command
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge_studio.explain import answering as daemon_explain
from tests.daemon.test_daemon import WAIT_S, connected, running
from tests.run.mini import AGENT, write_scenario

WAITING = (
    "\n(defrule mini-never (goal (id G) (mode RETRACTED)) (never) =>)\n(defrule broken (goal (nam G)) =>)"
)


@pytest.fixture(name="daemon")
def _daemon(tmp_path):
    scenario = write_scenario(tmp_path / "mini", agent=AGENT + WAITING)
    settings = (("fawkes/enable", False), ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]))
    with running(config=scenario, settings=settings, strict=False) as (made, _, _):
        yield made


def ask(board, name, kind=""):
    answer = ask_why(board, name, kind, 1, WAIT_S)
    assert answer is not None
    return "\n".join(answer["lines"])


def test_rules_and_goals_of_a_daemon(daemon):
    with connected(daemon) as board:
        text = ask(board, "mini-never")
        assert "mini.clp:26)" in text
        assert "in mini in the daemon, " in text
        assert (
            "there is no fact of 'never'" in text
            or "condition 1 (goal (id G) (mode RETRACTED)) has no match" in text
        )
        assert "it was refused when its file was loaded" in ask(board, "broken")
        with pytest.raises(CxbridgeError, match="neither a rule nor a goal 'nothing'"):
            ask(board, "nothing")
        assert "\ngoal G (MINI#1)" in ask(board, "G", "goal")
        assert "\ngoal G (MINI#1)" in ask(board, "MINI")


def test_a_paused_daemon_answers_and_one_that_was_reset(daemon):
    with connected(daemon) as board:
        assert send_command(board, "Pause", WAIT_S)
        assert "mini.clp:26)" in ask(board, "mini-never")
        assert send_command(board, "Reset", WAIT_S)
        assert "mini.clp:26)" in ask(board, "mini-never")


def test_the_loop_goes_on_while_an_answer_is_made(daemon, monkeypatch):
    go_on, looked = threading.Event(), threading.Event()

    def slow(*_):
        looked.set()
        assert go_on.wait(WAIT_S)
        return '{"lines": ["so it is"], "data": {}}'

    monkeypatch.setattr(daemon_explain, "_explain_to_json", slow)
    more = threading.Event()
    with connected(daemon) as board:
        told: list[str] = []
        asking = threading.Thread(target=lambda: told.append(ask(board, "x")))
        asking.start()
        assert looked.wait(WAIT_S)
        before = daemon.loop.cycle_count
        for _ in range(WAIT_S * 100):
            if daemon.loop.cycle_count > before + 3:
                break
            more.wait(0.01)
        assert daemon.loop.cycle_count > before + 3
        go_on.set()
        asking.join(WAIT_S)
        assert told == ["so it is"]


def test_a_fault_or_an_answer_that_is_too_long_ends_nothing(daemon, monkeypatch):
    with connected(daemon) as board:
        monkeypatch.setattr(daemon_explain, "_MAX_ANSWER_BYTES", 10)
        with pytest.raises(CxbridgeError, match="the reply is too long"):
            ask(board, "mini-never")
        monkeypatch.undo()
        monkeypatch.setattr(daemon_explain, "_explain_to_json", lambda *_: 1 // 0)
        with pytest.raises(CxbridgeError, match="an internal error of cxbridge: ZeroDivisionError"):
            ask(board, "mini-never")
        monkeypatch.undo()
        assert "mini.clp:26)" in ask(board, "mini-never")


def test_a_daemon_without_an_executive(tmp_path):
    settings = (("fawkes/enable", False), ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]))
    with (
        running(settings=settings) as (made, _, _),
        connected(made) as board,
        pytest.raises(BlackBoardError, match="no daemon with an executive"),
    ):
        ask(board, "x")


def test_the_command(daemon, capsys):
    url = daemon.endpoints[0]
    assert invoke(["why", "mini-never", "--connect", url]) == 0
    assert "rule mini-never (" in capsys.readouterr().out
    for words, message in (
        (["--at", "3"], "a daemon explains only its present state"),
        (["--env", "other"], "a daemon has no CLIPS environment 'other'"),
    ):
        assert invoke(["why", "mini-never", "--connect", url, *words]) == 2
        assert message in capsys.readouterr().err
