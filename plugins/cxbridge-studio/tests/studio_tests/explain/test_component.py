"""A running daemon answers `why` over its blackboard."""

from __future__ import annotations

import threading

import pytest

from cxbridge.cli.main import invoke
from cxbridge.daemon.client import ask_why, send_command
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge_studio.explain import component as daemon_explain
from tests.daemon.test_daemon import WAIT_S, connected, running
from tests.run.mini import AGENT, write_scenario

WAITING = (
    "\n(defrule mini-never (goal (id G) (mode RETRACTED)) (never) =>)\n(defrule broken (goal (nam G)) =>)"
)


@pytest.fixture(name="daemon")
def _daemon(tmp_path):
    scenario = write_scenario(tmp_path / "mini", agent=AGENT + WAITING)
    settings = (("fawkes/enable", False), ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]))
    with running(config=scenario, settings=settings, strict=False) as (daemon, _, _):
        yield daemon


def ask_daemon(board, name, kind=""):
    answer = ask_why(board, name, kind, 1, WAIT_S)
    assert answer is not None
    return "\n".join(answer["lines"])


def test_daemon_explains_rules_and_goals(daemon):
    with connected(daemon) as board:
        text = ask_daemon(board, "mini-never")
        assert "mini.clp:26)" in text
        assert "in mini in the daemon, " in text
        assert (
            "there is no fact of 'never'" in text
            or "condition 1 (goal (id G) (mode RETRACTED)) has no match" in text
        )
        assert "it was refused when its file was loaded" in ask_daemon(board, "broken")
        with pytest.raises(CxbridgeError, match="neither a rule nor a goal 'nothing'"):
            ask_daemon(board, "nothing")
        assert "\ngoal G (MINI#1)" in ask_daemon(board, "G", "goal")
        assert "\ngoal G (MINI#1)" in ask_daemon(board, "MINI")


def test_paused_and_reset_daemon_answers(daemon):
    with connected(daemon) as board:
        assert send_command(board, "Pause", WAIT_S)
        assert "mini.clp:26)" in ask_daemon(board, "mini-never")
        assert send_command(board, "Reset", WAIT_S)
        assert "mini.clp:26)" in ask_daemon(board, "mini-never")


def test_daemon_loop_continues_during_explanation(daemon, monkeypatch):
    may_answer, has_request = threading.Event(), threading.Event()

    def explain_slowly(*_):
        has_request.set()
        assert may_answer.wait(WAIT_S)
        return '{"lines": ["done"], "data": {}}'

    monkeypatch.setattr(daemon_explain, "_explain_to_json", explain_slowly)
    never_set = threading.Event()
    with connected(daemon) as board:
        answers: list[str] = []
        thread = threading.Thread(target=lambda: answers.append(ask_daemon(board, "x")))
        thread.start()
        assert has_request.wait(WAIT_S)
        before = daemon.loop.cycle_count
        for _ in range(WAIT_S * 100):
            if daemon.loop.cycle_count > before + 3:
                break
            never_set.wait(0.01)
        assert daemon.loop.cycle_count > before + 3
        may_answer.set()
        thread.join(WAIT_S)
        assert answers == ["done"]


def test_daemon_answers_after_fault_and_too_long_answer(daemon, monkeypatch):
    with connected(daemon) as board:
        monkeypatch.setattr(daemon_explain, "_MAX_ANSWER_BYTES", 10)
        with pytest.raises(CxbridgeError, match="the reply is too long"):
            ask_daemon(board, "mini-never")
        monkeypatch.undo()
        monkeypatch.setattr(daemon_explain, "_explain_to_json", lambda *_: 1 // 0)
        with pytest.raises(CxbridgeError, match="an internal error of cxbridge: ZeroDivisionError"):
            ask_daemon(board, "mini-never")
        monkeypatch.undo()
        assert "mini.clp:26)" in ask_daemon(board, "mini-never")


def test_daemon_without_executive_is_an_error(tmp_path):
    settings = (("fawkes/enable", False), ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]))
    with (
        running(settings=settings) as (daemon, _, _),
        connected(daemon) as board,
        pytest.raises(BlackBoardError, match="no daemon with an executive"),
    ):
        ask_daemon(board, "x")


def test_why_command_asks_daemon(daemon, capsys):
    url = daemon.endpoints[0]
    assert invoke(["why", "mini-never", "--connect", url]) == 0
    assert "rule mini-never (" in capsys.readouterr().out
    for words, message in (
        (["--at", "3"], "a daemon explains only its present state"),
        (["--env", "other"], "a daemon has no CLIPS environment 'other'"),
    ):
        assert invoke(["why", "mini-never", "--connect", url, *words]) == 2
        assert message in capsys.readouterr().err
