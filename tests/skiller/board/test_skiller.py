"""The Skiller of an agent on the skill board, as seen by agents."""

from __future__ import annotations

from typing import Any

import pytest

from cxbridge.skiller.board.service import BoardSkiller, LocalSkillCalls
from cxbridge.skiller.status import Status
from tests.skiller.board.rig import Rig


class SkillerRig(Rig):
    """An agent with a Skiller, and a reader of its interface."""

    def __init__(self):
        super().__init__()
        self.skill_board = self.skills()
        self.skiller = BoardSkiller(self.board, self.skill_board, self.bus, agent="r1", name="robot1")
        self.reader: Any = self.board.open_for_reading("SkillerInterface", "robot1", owner="agent")
        self.writes = []

    def send(self, kind, reader=None, **fields):
        """Send a message; return its id."""
        reader = reader or self.reader
        message = reader.create_message(f"{kind}Message")
        for name, value in fields.items():
            message.set(name, value)
        return reader.msgq_enqueue(message)

    def exec(self, text, reader=None):
        return self.send("ExecSkill", reader, skill_string=text)

    def run(self, loops=4):
        """Run loops and record the published states."""
        for _ in range(loops):
            self.skiller.handle_messages()
            self._record()
            self.loop()
            self.skiller.publish()
            self._record()

    def _record(self):
        self.reader.read()
        state = (self.reader.status.name, self.reader.error)
        if not self.writes or self.writes[-1] != state:
            self.writes.append(state)

    @property
    def now(self):
        self.reader.read()
        return self.reader

    def close(self):
        self.skiller.close()
        super().close()


@pytest.fixture
def rig():
    rig = SkillerRig()
    yield rig
    rig.close()


def test_skill_string_runs_and_becomes_final(rig):
    puppet = rig.puppet("r1", "e1")
    msgid = rig.exec('move{to="wp1", n=3}')
    rig.run()
    assert (rig.now.status, rig.now.msgid, rig.now.skill_string) == (
        Status.S_RUNNING,
        msgid,
        'move{to="wp1", n=3}',
    )
    assert rig.skiller.running
    assert puppet.calls[0].parameters == {"to": "wp1", "n": 3}
    puppet.ends.append(None)
    rig.run()
    assert rig.writes == [("S_RUNNING", ""), ("S_FINAL", "")]
    assert (rig.now.msgid, rig.now.skill_string) == (msgid, 'move{to="wp1", n=3}')
    assert not rig.skiller.running


def test_first_failure_cancels_remaining_calls(rig):
    first, second = rig.puppet("r1", "e1"), rig.puppet("r1", "e2")
    rig.exec("move{}; grasp{}")
    rig.run()
    first.ends.append("no")
    rig.run()
    assert rig.writes[-1] == ("S_FAILED", "no")
    assert second.cleaned == 1
    assert not rig.skill_board.running


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("move{", "column 6: the skill string ends"),
        ("", "the skill string has no call of a skill"),
        ("x = 3", "column 3: '=' stands where"),
        ("move{to=somewhere}", "column 9: 'somewhere' stands"),
        ("move{to={1, {deep=other}}}", "'other' stands"),
        (f"{'m' * 65}{{}}", "a skill cannot be called"),
        ("move{}; say{text='" + '"' * 600 + "'}", "the parameters have"),
    ],
)
def test_invalid_skill_string_fails_at_once(rig, text, error):
    puppet = rig.puppet("r1", "e1")
    rig.exec(text)
    rig.run()
    assert rig.now.status == Status.S_FAILED
    assert error[:40] in rig.now.error or error in rig.now.error
    assert puppet.cleaned == len(puppet.calls)
    assert not rig.skill_board.running


def test_tables_and_positional_arguments_are_parameters(rig):
    puppet = rig.puppet("r1", "e1")
    rig.exec('move("wp1", {1, a=true}, nil)')
    rig.run()
    assert puppet.calls[0].parameters == {"1": "wp1", "2": {"1": 1, "a": True}, "3": None}


def test_stop_cancels_skill_string(rig):
    puppet = rig.puppet("r1", "e1")
    rig.exec("move{}")
    rig.run()
    rig.send("StopExec")
    rig.run()
    assert (rig.now.status, rig.now.skill_string, rig.now.msgid) == (Status.S_INACTIVE, "", 0)
    assert puppet.cleaned == 1
    assert not rig.skill_board.running


def test_new_skill_string_replaces_running_skill_string(rig):
    puppet = rig.puppet("r1", "e1")
    rig.exec("move{}")
    rig.run()
    second = rig.exec("grasp{}")
    rig.run(6)
    assert [call.skill for call in puppet.calls] == ["move", "grasp"]
    assert (rig.now.status, rig.now.msgid) == (Status.S_RUNNING, second)
    assert any("Aborting execution of previous skill string 'move{}'" in line for line in rig.lines)


def test_local_skill_calls_accept_single_call(rig):
    local_calls = LocalSkillCalls(rig.skill_board)
    with pytest.raises(Exception, match="must have one call, not 2"):
        local_calls.request_string("move{}; move{}", "r1", lambda _master: None)
    master = local_calls.request_string('move{to="x"}', "r1", lambda _master: None)
    assert local_calls.cancel(master.number)
    assert not local_calls.cancel(master.number)
    assert not local_calls.cancel(99)
