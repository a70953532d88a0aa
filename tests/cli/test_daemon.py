"""The command `cxbridge daemon` with its subcommands."""

from __future__ import annotations

import json

import pytest

from cxbridge.blackboard import EventKind, Listener
from cxbridge.cli.commands import daemon
from cxbridge.cli.main import invoke
from cxbridge.daemon.interfaces import DaemonInterfaces
from cxbridge.run.components.manager import ComponentStatus, State
from tests.cli.boards import SharedBoard
from tests.fawkes import NO_SERVER
from tests.support import needs_plugin


class CommandRecorder(Listener):
    """Follows commands to the daemon at once."""

    def __init__(self, status):
        self.status = status
        self.received_types: list[str] = []

    def message_received(self, interface, message):
        self.received_types.append(message.type)
        self.status.acknowledge(message.id)
        self.status.publish("RUNNING", [])
        return False


@pytest.fixture
def board(monkeypatch):
    made = SharedBoard()
    monkeypatch.setattr(daemon, "connect", lambda _url, _dirs: made)
    yield made
    made.shutdown()


@pytest.fixture
def status(board):
    made = DaemonInterfaces(board, ["blackboard", "skiller"], "real")
    made.set_field("endpoints", "ipc:///x")
    board.open_for_writing("RequestInterface", "cxbridge")
    made.publish(
        "RUNNING", [ComponentStatus(name, State.ACTIVE, "", 5) for name in ("blackboard", "skiller")]
    )
    return made


def test_status(status, capsys):
    assert invoke(["daemon", "status"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "is running" in lines[0]
    assert lines[1:] == ["at ipc:///x", "  blackboard  active", "  skiller     active"]


def test_status_of_degraded_daemon_is_1(status, capsys):
    status.publish("DEGRADED", [ComponentStatus("skiller", State.UNCONFIGURED, "no skills", 6)])
    assert invoke(["daemon", "status", "--json"]) == 1
    row = json.loads(capsys.readouterr().out)
    assert row["components"][1] == {
        "name": "skiller",
        "state": "UNCONFIGURED",
        "since_us": 6,
        "reason": "no skills",
    }


def test_status_without_daemon_is_2(board, capsys):
    assert invoke(["daemon", "status"]) == 2
    assert "has no daemon" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["pause", "resume", "reset", "shutdown"])
def test_commands(board, status, command):
    recorder = CommandRecorder(status)
    board.register_listener(recorder, status._daemon_interface, EventKind.MESSAGE_RECEIVED)
    assert invoke(["daemon", command]) == 0
    assert recorder.received_types == [f"{command.capitalize()}Message"]


def test_silent_daemon_is_status_3(status, monkeypatch, capsys):
    monkeypatch.setattr(daemon, "_COMMAND_TIMEOUT_S", 0.01)
    assert invoke(["daemon", "pause"]) == 3
    assert "did not pause within" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["/nowhere"], "there is no such scenario"),
        (["start", "/nowhere"], "there is no such scenario"),
        (["--skiller", "butler"], "/cxbridge/skiller cannot be 'butler'"),
        (["--clock", "virtual"], "virtual clock"),
        (["--endpoint", "tcp://0.0.0.0:*", *NO_SERVER, "--skiller", "none"], "CURVE keys"),
        pytest.param(
            ["--fawkes-host", "0.0.0.0", "--fawkes-port", "0", "--skiller", "none"],
            "0.0.0.0",
            marks=needs_plugin("fawkes"),
        ),
        (["--nonsense"], "nonsense"),
    ],
)
def test_bad_input_is_one_message_and_status_2(arguments, message, capsys, tmp_path):
    if "--endpoint" not in arguments:
        arguments = [*arguments, "--endpoint", f"ipc://{tmp_path}/bb"]
    assert invoke(["daemon", *arguments]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert "Traceback" not in captured.err
