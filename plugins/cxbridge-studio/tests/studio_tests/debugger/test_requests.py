"""The debugger and the environments of a daemon, over its blackboard."""

from __future__ import annotations

import json

import pytest

from cxbridge.cli.main import invoke
from cxbridge.daemon import requests as daemon_requests
from cxbridge.daemon.client import NoAnswerError, read_status, request, send_command
from cxbridge.errors import CxbridgeError
from cxbridge.events import LogLine
from cxbridge_studio.cli.daemon_break import _take_step as step
from tests.daemon.test_daemon import WAIT_S, connected, running, until
from tests.run.mini import write_scenario

PING = """
(defrule ping ?f <- (ping ?n) => (retract ?f) (assert (pong ?n)))
(defrule pong (pong ?n) => (assert (done ?n)))
(defrule make (make ?id) => (assert (goal (id ?id) (class MADE))))
"""


@pytest.fixture(name="daemon")
def _daemon(tmp_path):
    scenario = write_scenario(tmp_path / "mini", agent=PING)
    settings = (("fawkes/enable", False), ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]))
    with running(config=scenario, settings=settings) as (daemon, _, _):
        yield daemon


@pytest.fixture(name="board")
def _board(daemon):
    with connected(daemon) as board:
        yield board


@pytest.fixture(name="ask")
def _ask(board):
    return lambda verb, **arguments: request(board, verb, WAIT_S, **arguments)


def list_facts(ask, name):
    try:
        return [text for _, text in ask("facts", env="executive", template=name)]
    except CxbridgeError:
        return []


def test_daemon_loop_continues_while_rules_are_stopped(daemon, board, ask):
    assert ask("break-add", specs=["rule:pong"]) == [{"number": 1, "spec": "rule:pong"}]
    ask("assert", env="executive", fact="(ping 1)")
    assert until(lambda: ask("where") is not None)
    where = ask("where")
    assert (where["reason"], where["rule"], where["next_rule"]) == ("before rule pong", "ping", "pong")
    loops = daemon.loop.cycle_count
    assert until(lambda: daemon.loop.cycle_count > loops + 2)
    assert list_facts(ask, "done") == []
    assert read_status(board)["state"] == "RUNNING"
    index = ask("facts", env="executive", template="pong")[0][0]
    assert ask("agenda", env="executive", limit=1) == [[0, "pong", f"f-{index}"]]
    ask("retract", env="executive", index=index)
    ask("assert", env="executive", fact="(pong 2)")
    ask("break-remove", numbers=[1])
    assert send_command(board, "Resume", WAIT_S)
    assert until(lambda: list_facts(ask, "done") == ["(done 2)"])
    assert ask("where") is None


def test_steps_stop_after_rule_and_loop(board, ask):
    ask("break-add", specs=["after:ping"])
    ask("assert", env="executive", fact="(ping 1)")
    assert until(lambda: ask("where") is not None)
    assert step(board, "rule", WAIT_S) == "after rule pong"
    assert step(board, "loop", WAIT_S) == "at the end of the loop"
    ask("go-on")
    assert until(lambda: ask("where") is None)
    assert step(board, "rule", WAIT_S).startswith("after rule ")  # the rules ran
    ask("go-on")
    ask("stop")
    assert until(lambda: ask("where") is not None)
    with pytest.raises(CxbridgeError, match="'year' is not a unit of steps"):
        step(board, "year", WAIT_S)


def test_breakpoints_invalid_after_reset_are_logged(daemon, board, ask, tmp_path):
    ask("break-add", specs=["rule:pong", "goal:X:FINISHED"])
    write_scenario(tmp_path / "mini", agent=PING.replace("pong", "pang"))
    lines = []
    daemon.bus.subscribe(lambda event: lines.append(event.text), LogLine)
    assert send_command(board, "Reset", WAIT_S)
    message = "breakpoint rule:pong: there is no rule 'pong' hint: did you mean ping or pang?"
    assert until(lambda: any(line.startswith(message) for line in lines))
    assert [item["spec"] for item in ask("break-list")] == ["rule:pong", "goal:X:FINISHED"]


def test_invalid_utf_8_in_fact_is_shown(daemon, ask, capsys):
    ask("break-add", specs=["goal:*"])
    ask("assert", env="executive", fact='(make "bad\udcff")')
    assert until(lambda: ask("where") is not None)
    assert "bad\udcff" in ask("where")["reason"]
    assert invoke(["daemon", "break", "list", "--connect", daemon.endpoints[0]]) == 0
    assert invoke(["env", "facts", "executive", "make", "--connect", daemon.endpoints[0]]) == 0
    assert '(make "bad' in capsys.readouterr().out


def test_invalid_requests_are_errors(ask):
    for message, verb, arguments in (
        ("the request 'fly' is unknown", "fly", {}),
        ("arguments of facts are wrong", "facts", {}),
        ("arguments of facts are wrong", "facts", {"env": "executive", "limit": float("inf")}),
        ("no CLIPS environment 'x'", "facts", {"env": "x"}),
        ("no deftemplate 'x'", "facts", {"env": "executive", "template": "x"}),
        ("is not a breakpoint", "break-add", {"specs": ["fly"]}),
        ("no rule 'pon'", "break-add", {"specs": ["rule:pong", "rule:pon"]}),  # no breakpoint is added
        ("no mode 'FINISHD'", "break-add", {"specs": ["goal:MADE:FINISHD"]}),
        ("no skill 'sya'", "break-add", {"specs": ["skill:sya"]}),
        ("does not assert", "assert", {"env": "executive", "fact": "x"}),
        ("are too long", "assert", {"env": "executive", "fact": "x" * 9000}),
    ):
        with pytest.raises(CxbridgeError, match=message):
            ask(verb, **arguments)
    assert ask("break-list") == []


def test_reply_above_size_limit_is_an_error(ask):
    for number in range(200):
        ask("assert", env="executive", fact=f'(long {number} "{"x" * 4000}")')
        if number % 70 == 69:
            break
    with pytest.raises(CxbridgeError, match="too long"):
        ask("facts", env="executive", template="long")
    assert len(ask("facts", env="executive", template="long", limit=10)) == 10


def test_daemon_without_executive_refuses_requests(tmp_path):
    settings = (("fawkes/enable", False), ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]))
    with running(settings=settings) as (daemon, _, _), connected(daemon) as board:
        with pytest.raises(CxbridgeError, match="this daemon has no executive"):
            request(board, "where", WAIT_S)
        with pytest.raises(CxbridgeError, match="this daemon has no executive"):
            step(board, "rule", WAIT_S)
        with pytest.raises(CxbridgeError, match="this daemon has no executive"):
            request(board, "env-list", WAIT_S)
        state = request(board, "state", WAIT_S)
        assert (state["goals"], state["environments"], state["where"]) == ([], [], None)
    assert NoAnswerError("x").exit_status == 3


def test_commands_debug_and_edit_daemon(daemon, ask, tmp_path, capsys):
    def cli(*words):
        status = invoke([*words, "--connect", daemon.endpoints[0]])
        return status, *capsys.readouterr()

    assert cli("daemon", "break", "add", "rule:pong", "goal:X")[:2] == (0, "1  rule:pong\n2  goal:X\n")
    assert cli("daemon", "break", "remove", "2")[0] == 0
    assert cli("env", "assert", "executive", "(ping 5)")[1].startswith("f-")
    assert until(lambda: ask("where") is not None)
    _, out, _ = cli("daemon", "break", "list")
    assert out == "1  rule:pong\nstopped before rule pong (breakpoint 1)\n  fired last: ping; next: pong\n"
    assert json.loads(cli("daemon", "break", "list", "--json")[1])["stopped"]["kind"] == "before"
    status_json = json.loads(cli("daemon", "status", "--json")[1])
    assert status_json["stopped"] == "before rule pong"
    assert (status_json["stop"]["breakpoint"], status_json["stop"]["next_rule"]) == (1, "pong")
    _, out, _ = cli("daemon", "status")
    assert "\nrules are stopped before rule pong\n  breakpoint 1; fired last: ping; next: pong\n" in out
    status, out, _ = cli("env", "agenda", "executive")
    assert out.startswith("     0 pong: f-")
    _, out, _ = cli("env", "facts", "executive", "pong")
    assert out.endswith(" (pong 5)\n")
    assert cli("env", "retract", "executive", out.split()[0])[0] == 0
    assert cli("daemon", "step", "loop")[:2] == (0, "stopped at the end of the loop\n")
    assert cli("daemon", "break", "remove", "--all")[0] == 0
    assert ask("break-list") == []
    assert cli("daemon", "resume")[0] == 0
    assert until(lambda: ask("where") is None)
    assert until(lambda: json.loads(cli("daemon", "status", "--json")[1])["stop"] is None)
    assert "rules are stopped" not in cli("daemon", "status")[1]
    assert cli("daemon", "break", "remove")[0] == 2
    assert cli("env", "retract", "executive", "one")[0] == 2

    file = tmp_path / "mine.clp"
    file.write_text("(deftemplate cup (slot level))\n(defrule bad (cup (leve 1)) =>)")
    assert cli("env", "create", "mine")[0] == 0
    status, _, error = cli("env", "load", "mine", str(file))
    assert status == 1
    assert "mine.clp:2: defrule bad is not defined" in error
    assert cli("env", "watch", "mine", "facts", "cup")[0] == 0
    assert cli("env", "log", "mine", "info")[0] == 0
    index = cli("env", "assert", "mine", "(cup (level 1))")[1].strip()
    assert cli("env", "modify", "mine", index, "level=2")[1].startswith("f-")
    assert json.loads(cli("env", "facts", "mine", "cup", "--json")[1])[0]["text"] == "(cup (level 2))"
    assert cli("env", "eval", "mine", '(progn (printout t "said" crlf) (+ 1 2))')[:2] == (0, "said\n3\n")
    assert ", agenda 0, log info, watch facts\n" in cli("env", "list")[1]


def test_log_excerpt_of_request_is_escaped():
    assert (
        daemon_requests._log_excerpt("{}\nE Daemon: on fire\x1b[2J") == r"{}\u000aE Daemon: on fire\u001b[2J"
    )
    assert len(daemon_requests._log_excerpt("x" * 10_000)) == 500
