"""The commands `cxbridge bb ...`, on a blackboard of this process."""

from __future__ import annotations

import json
import threading

import pytest

from cxbridge.blackboard import Listener
from cxbridge.blackboard.following import Feed
from cxbridge.cli.commands import bb
from cxbridge.cli.main import invoke
from cxbridge.interfaces import SkillerInterface
from tests.cli.boards import WAIT_S, board_of


@pytest.fixture
def board(monkeypatch):
    with board_of(bb, monkeypatch) as board:
        yield board


@pytest.fixture
def skiller(board):
    return board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")


def run(*arguments):
    return invoke(["bb", *arguments])


def test_list(board, skiller, capsys):
    board.open_for_reading("TestInterface", "T", owner="reader")
    assert run("list") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["INTERFACE", "WRITER", "READERS", "WRITTEN"]
    assert lines[1].split() == ["SkillerInterface::Skiller", "skiller", "0", "never"]
    assert lines[2].split() == ["TestInterface::T", "-", "reader", "never"]


def test_list_as_json_with_a_pattern(board, skiller, capsys):
    board.open_for_reading("TestInterface", "T")
    skiller.msgid = 1
    skiller.write()
    assert run("list", "Skiller*", "--json") == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert (row["uid"], row["writer"], row["num_readers"]) == ("SkillerInterface::Skiller", "skiller", 0)
    assert row["timestamp_us"] == skiller.timestamp_us
    assert row["hash"] == SkillerInterface.SCHEMA.hash_printable


def test_show(board, skiller, capsys):
    skiller.skill_string = 'say{text="ä"}'
    skiller.status = SkillerInterface.S_RUNNING
    skiller.write()
    assert run("show", "SkillerInterface::Skiller") == 0
    output = capsys.readouterr().out
    assert 'skill_string          "say{text=\\"ä\\"}"' in output
    assert "status                S_RUNNING" in output
    assert run("show", "SkillerInterface::Skiller", "--json") == 0
    assert json.loads(capsys.readouterr().out)["fields"]["status"] == "S_RUNNING"


def test_show_of_missing_interface_is_status_2(board, skiller, capsys):
    assert run("show", "SkillerInterface::Skillet") == 2
    error = capsys.readouterr().err
    assert "no process has SkillerInterface::Skillet open" in error
    assert "SkillerInterface::Skiller" in error
    assert run("show", "Skiller") == 2


def test_watch_prints_changes_up_to_count(board, monkeypatch, capsys):
    interface = board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    waits = threading.Event()
    wait = Feed.wait_for_change

    def next_news(self, deadline):
        waits.set()  # the command has read the initial values
        return wait(self, deadline)

    def work():
        assert waits.wait(WAIT_S)
        for number in (1, 1, 2):
            interface.msgid = number
            interface.skill_string = "s"
            interface.write()
        interface.close()

    monkeypatch.setattr(Feed, "wait_for_change", next_news)
    writer = threading.Thread(target=work)
    writer.start()
    assert run("watch", "Skiller*", "--count", "3", "--timeout", str(WAIT_S)) == 0
    writer.join()
    lines = [line.split("  ", 1)[1] for line in capsys.readouterr().out.splitlines()]
    assert lines == [
        'SkillerInterface::Skiller  skill_string="s" msgid=1',
        "SkillerInterface::Skiller  msgid=2",
        "SkillerInterface::Skiller  writer removed",
    ]


def test_watch_ends_at_timeout(board, skiller):
    assert run("watch", "*", "--timeout", "0.01") == 0
    assert run("watch", "*", "--timeout", "0.01", "--count", "1") == 3


def test_set_writes_named_fields_only(board, skiller, capsys):
    skiller.skill_string = "kept"
    skiller.write()
    reader = board.open_for_reading(SkillerInterface, "Skiller")
    skiller.close()
    assert run("set", "SkillerInterface::Skiller", "msgid=16", "status=S_FAILED") == 0
    assert reader.read()
    assert (reader.skill_string, reader.msgid, reader.status) == ("kept", 16, SkillerInterface.S_FAILED)
    assert reader.changed


def test_send_prints_message_id(board, skiller, capsys):
    assert run("send", "SkillerInterface::Skiller", "ExecSkill", 'skill_string=say{text="a=b"}') == 0
    assert capsys.readouterr().out == "1\n"
    message = skiller.msgq_pop()
    assert (message.type, message.skill_string) == ("ExecSkillMessage", 'say{text="a=b"}')


def test_send_waits_for_answer(board, capsys):
    skiller = board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")

    class Answer(Listener):
        def message_received(self, interface, message):
            interface.msgid = message.id
            interface.error = "answered"
            interface.write()
            return False

    board.register_listener(Answer(), skiller)
    assert run("send", "SkillerInterface::Skiller", "StopExecMessage", "--wait", "--timeout", "10") == 0
    assert '"answered"' in capsys.readouterr().out


def test_send_times_out_without_answer(board, skiller, capsys):
    assert run("send", "SkillerInterface::Skiller", "StopExec", "--wait", "--timeout", "0.01") == 3
    assert "no answer to message 1" in capsys.readouterr().err


def test_undeliverable_message_is_status_2(board, skiller, capsys):
    reader = board.open_for_reading(SkillerInterface, "Lonely")
    assert run("send", "SkillerInterface::Lonely", "StopExec") == 2
    assert run("send", "SkillerInterface::Skiller", "Nonsense") == 2
    assert "Traceback" not in capsys.readouterr().err
    reader.close()
