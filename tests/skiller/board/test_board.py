"""Masters and executors in a single process, by the tables of docs/evidence/skill-board.md."""

from __future__ import annotations

import pytest

from cxbridge.errors import ConfigError, SkillError
from cxbridge.skiller.board import SkillCall, Steps
from cxbridge.skiller.board.master import Master, Timeouts
from cxbridge.skiller.board.protocol import MasterState
from tests.skiller.board.rig import Puppet, Rig, call, states

EXECUTOR = "SkillExecutorInterface"
BOARD = "SkillBoardInterface"


@pytest.fixture
def rig():
    rig = Rig()
    yield rig
    rig.close()


class Recorder:
    """Records the states of a master."""

    def __init__(self) -> None:
        self.states: list[str] = []

    def __call__(self, master: Master) -> None:
        if not self.states or self.states[-1] != master.state:
            self.states.append(str(master.state))


def send(rig, uid, message_type, **fields):
    """Send a message from a reader."""
    kind, _, name = uid.partition("::")
    with rig.board.open_for_reading(kind, name, owner="test") as reader:
        message = reader.create_message(message_type)
        for field, value in fields.items():
            message.set(field, value)
        reader.msgq_enqueue(message)


def to_board(rig, message_type, master, *, executor, epoch=None, board=0, **fields):
    """Send a message of an executor to a skill board."""
    skills = rig.boards[board]
    send(
        rig,
        f"{BOARD}::{skills.name}",
        message_type,
        epoch=skills.epoch if epoch is None else epoch,
        master=master if isinstance(master, int) else master.number,
        executor=executor,
        **fields,
    )


def executor_data(rig, name):
    with rig.board.open_for_reading(EXECUTOR, name, owner="test") as reader:
        reader.read()
        return reader.as_dict()


class Silent:
    """An executor that only publishes its interface and collects its messages."""

    def __init__(self, rig, name="e1", agent="r1", skills="move"):
        self.interface = rig.board.open_for_writing(EXECUTOR, name, owner="test")
        self.interface.agent, self.interface.skills = agent, skills
        self.interface.write()

    def messages(self):
        messages = []
        while (message := self.interface.msgq_pop()) is not None:
            messages.append(message)
        return messages

    def types(self):
        return [message.type.removesuffix("Message") for message in self.messages()]


# -- the course of an action


def test_action_runs_from_request_to_finish(rig):
    skills, recorder = rig.skills(), Recorder()
    puppet = rig.puppet("r1", "e1")
    master = skills.request(call(to="wp1", speed=0.5, slow=True), recorder)
    rig.until(lambda: master.state is MasterState.RUNNING)
    assert puppet.calls == [call(to="wp1", speed=0.5, slow=True)]
    data = executor_data(rig, "e1")
    assert (data["state"].name, data["skill"], data["master"], data["board"]) == (
        "BUSY",
        "move",
        1,
        "SkillBoard",
    )
    puppet.progress = 0.5
    rig.until(lambda: master.progress == 0.5)
    assert master.feedback == "move on"
    assert master.executor == "e1"
    puppet.ends.append(None)
    rig.until(lambda: master.is_over)
    assert recorder.states == ["CONFIRMED", "RUNNING", "SUCCEEDED"]
    assert master.progress == 1.0
    data = executor_data(rig, "e1")
    assert (data["state"].name, data["skill"], data["master"]) == ("IDLE", "", 0)
    assert not skills.running


def test_exception_of_executor_is_failure(rig):
    class Broken(Puppet):
        def execute(self, call: SkillCall) -> Steps:
            yield 0.1
            raise ZeroDivisionError("lone \udc80 surrogate\0")

    skills = rig.skills()
    rig.puppet("r1", "e1", Broken)
    master = skills.request(call())
    rig.until(lambda: master.is_over)
    assert master.state is MasterState.FAILED
    assert master.error.startswith("ZeroDivisionError: lone ? surrogate")


@pytest.mark.parametrize(
    ("progress", "state"), [(2.0, "RUNNING"), (float("nan"), "RUNNING"), ("half", "FAILED")]
)
def test_progress_is_number_from_0_to_1(rig, progress, state):
    class Odd(Puppet):
        def execute(self, call: SkillCall) -> Steps:
            while True:
                yield progress

    skills = rig.skills()
    rig.puppet("r1", "e1", Odd)
    master = skills.request(call())
    rig.loop(10)
    assert states(master) == [state]
    assert 0.0 <= master.progress <= 1.0


# -- cancelling


def test_cancel_without_answer_cancels_action(rig):
    skills, silent = rig.skills(), Silent(rig)
    rig.loop()
    master = skills.request(call())
    to_board(rig, "ResponseMessage", master, executor="e1")
    to_board(rig, "FeedbackMessage", master, executor="e1")
    rig.loop()
    skills.cancel(master)
    assert states(master) == ["CANCELLING"]
    rig.until(lambda: master.is_over)
    assert (str(master.state), master.error) == ("CANCELLED", "e1 did not answer CANCEL")
    assert silent.types() == ["Request", "Confirm", "Cancel"]


def test_failed_cleanup_leaves_cancelled_skill_cancelled(rig):
    class Messy(Puppet):
        def execute(self, call: SkillCall) -> Steps:
            try:
                while True:
                    yield None
            finally:
                raise RuntimeError("brakes failed")

    skills = rig.skills()
    rig.puppet("r1", "e1", Messy)
    master = skills.request(call())
    rig.until(lambda: master.state is MasterState.RUNNING)
    skills.cancel(master)
    rig.until(lambda: master.is_over)
    assert states(master) == ["CANCELLED"]
    assert any("brakes failed" in line for line in rig.lines)


# -- executors that violate the protocol


def test_executor_of_finished_master_gets_cancel(rig):
    skills, silent = rig.skills(), Silent(rig)
    rig.loop()
    master = skills.request(call())
    skills.cancel(master)
    to_board(rig, "FeedbackMessage", master, executor="e1")
    to_board(rig, "FinishMessage", master, executor="e1", outcome="SUCCEEDED")
    rig.loop()
    assert silent.types() == ["Request", "Cancel"]
    assert states(master) == ["CANCELLED"]


def test_executor_of_wrong_agent_is_rejected(rig):
    skills, silent = rig.skills(), Silent(rig, agent="r2")
    rig.loop()
    master = skills.request(call(agent="r1"))
    to_board(rig, "ResponseMessage", master, executor="e1")
    rig.loop()
    assert silent.types() == ["Reject"]
    assert states(master) == ["ASKING"]
    assert "W e1 of r2 answers to action 1 of r1" in rig.lines


def test_interfering_executor_gets_cancel(rig):
    skills, silent, _puppet = rig.skills(), Silent(rig, "other", skills="dance"), rig.puppet("r1", "e1")
    master = skills.request(call())
    rig.until(lambda: master.state is MasterState.RUNNING)
    to_board(rig, "FeedbackMessage", master, executor="other", progress=0.9)
    to_board(rig, "FinishMessage", master, executor="other", outcome="FAILED", error="ha")
    to_board(rig, "ResponseMessage", master, executor="other")
    rig.loop()
    assert silent.types() == ["Cancel", "Reject"]
    assert (str(master.state), master.progress) == ("RUNNING", 0.0)


def test_messages_of_earlier_epoch_are_rejected(rig):
    skills, silent = rig.skills(), Silent(rig)
    rig.loop()
    master = skills.request(call())
    to_board(rig, "ResponseMessage", master, executor="e1", epoch=skills.epoch - 1)
    to_board(rig, "FinishMessage", master, executor="e1", epoch=skills.epoch - 1, outcome="SUCCEEDED")
    rig.loop()
    assert states(master) == ["ASKING"]
    request, reject = silent.messages()
    assert (reject.type, reject.epoch) == ("RejectMessage", skills.epoch - 1)
    assert request.epoch == skills.epoch


def test_refused_request_goes_to_next_executor(rig):
    skills, silent = rig.skills(), Silent(rig)
    rig.loop()
    master = skills.request(call())
    to_board(rig, "ResponseMessage", master, executor="e1")
    rig.loop()
    puppet = rig.puppet("r1", "e2")
    to_board(rig, "FinishMessage", master, executor="e1", outcome="REFUSED")
    rig.until(lambda: master.state is MasterState.RUNNING)
    assert master.executor == "e2"
    assert len(puppet.calls) == 1
    assert silent.types() == ["Request", "Confirm"]


# -- waiting


def make_busy(rig, name):
    rig.puppet("r1", name)
    rig.boards[0].request(call(skill="grasp"))
    rig.loop(3)


@pytest.mark.parametrize(
    ("make", "error"),
    [
        (lambda _rig: None, "the agent r1 has no executor"),
        (
            lambda rig: Silent(rig, skills="grasp dance"),
            "no executor of r1 offers move; they offer: dance, grasp",
        ),
        (Silent, "no executor of r1 is free for move, or answers: e1 (IDLE)"),
        (
            lambda rig: make_busy(rig, "e1"),
            "no executor of r1 is free for move, or answers: e1 (grasp)",
        ),
    ],
)
def test_action_fails_without_free_executor(rig, make, error):
    skills = rig.skills(timeouts=Timeouts(start=0.5))
    writer = make(rig)
    rig.loop()
    master = skills.request(call())
    rig.until(lambda: master.is_over, loops=20)
    assert (str(master.state), master.error) == ("FAILED", error)
    del writer


def test_silent_executor_fails_action(rig):
    skills, silent = rig.skills(), Silent(rig)
    rig.loop()
    master = skills.request(call())
    to_board(rig, "ResponseMessage", master, executor="e1")
    to_board(rig, "FeedbackMessage", master, executor="e1", progress=0.1)
    rig.until(lambda: master.is_over)
    assert (str(master.state), master.error) == ("FAILED", "the executor e1 was silent for 5 s")
    assert silent.types() == ["Request", "Confirm", "Cancel"]


def test_silent_executor_delays_no_action(rig):
    skills, _silent, puppet = rig.skills(), Silent(rig), rig.puppet("r1", "e2")
    rig.loop()
    first = skills.request(call())
    rig.until(lambda: first.state is MasterState.RUNNING, loops=5)
    assert first.executor == "e2"
    second, third = skills.request(call()), skills.request(call())
    puppet.ends.append(None)
    rig.until(lambda: third.state is MasterState.RUNNING, loops=10)
    assert states(first, second) == ["SUCCEEDED", "ASKING"]


def test_confirmed_executor_that_never_begins_fails_action(rig):
    skills, silent = rig.skills(timeouts=Timeouts(start=0.5)), Silent(rig)
    rig.loop()
    master = skills.request(call())
    to_board(rig, "ResponseMessage", master, executor="e1")
    rig.until(lambda: master.is_over, loops=40)
    assert (str(master.state), master.error) == ("FAILED", "the executor e1 did not begin for 0.5 s")
    assert silent.types() == ["Request", "Confirm", "Cancel"]


def test_reservation_of_executor_times_out(rig):
    rig.puppet("r1", "e1")
    stranger = rig.board.open_for_writing(BOARD, "Stranger", owner="test")
    fields = {"board": "Stranger", "epoch": 7, "master": 1}
    send(rig, f"{EXECUTOR}::e1", "RequestMessage", agent="r1", skill="move", **fields)
    rig.loop()
    assert rig.host("e1").state == "RESERVED"
    assert stranger.msgq_pop().type == "ResponseMessage"
    rig.loop(70)
    assert rig.host("e1").state == "IDLE"
    send(rig, f"{EXECUTOR}::e1", "ConfirmMessage", **fields)
    rig.loop()
    late = stranger.msgq_pop()
    assert (late.type, late.outcome.name) == ("FinishMessage", "REFUSED")


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan"), float("inf")])
def test_timeouts_must_be_above_0(seconds):
    with pytest.raises(ConfigError, match="above 0"):
        Timeouts(silence=seconds)


# -- the end of an executor


def test_cancelled_action_of_dead_executor_is_cancelled(rig):
    skills = rig.skills()
    rig.puppet("r1", "e1")
    master = skills.request(call())
    rig.until(lambda: master.state is MasterState.RUNNING)
    skills.cancel(master)
    rig.kill("e1")
    rig.loop()
    assert states(master) == ["CANCELLED"]


# -- names and parameters


@pytest.mark.parametrize("name", ["", "x" * 65, "\udc80"])
def test_invalid_names_are_refused(rig, name):
    skills = rig.skills()
    with pytest.raises(SkillError, match="cannot be called"):
        skills.request(SkillCall(name, "r1"))
    with pytest.raises(SkillError, match="cannot be called"):
        skills.request(SkillCall("move", name))
    with pytest.raises(SkillError, match="cannot be called"):
        rig.puppet("r1", name)
    assert not skills.running


@pytest.mark.parametrize("value", ["x" * 1020, object(), float("inf"), "\udc80"])
def test_invalid_parameters_are_refused(rig, value):
    with pytest.raises(SkillError):
        rig.skills().request(call(to=value))


@pytest.mark.parametrize("parameters", ["{", "[]", "3", '{"a": ' + "[" * 500])
def test_request_with_invalid_parameters_fails(rig, parameters):
    puppet = rig.puppet("r1", "e1")
    stranger = rig.board.open_for_writing(BOARD, "Stranger", owner="test")
    fields = {"board": "Stranger", "epoch": 7, "master": 1}
    send(rig, f"{EXECUTOR}::e1", "RequestMessage", agent="r1", skill="move", parameters=parameters, **fields)
    rig.loop()
    send(rig, f"{EXECUTOR}::e1", "ConfirmMessage", **fields)
    rig.loop()
    answers = [stranger.msgq_pop() for _ in range(2)]
    assert [answer.type for answer in answers] == ["ResponseMessage", "FinishMessage"]
    assert answers[1].outcome.name == "FAILED"
    assert puppet.calls == []


def test_board_publishes_number_of_actions(rig):
    skills = rig.skills()
    rig.puppet("r1", "e1")
    for _ in range(3):
        skills.request(call())
    rig.loop(3)
    with rig.board.open_for_reading(BOARD, "SkillBoard", owner="test") as reader:
        reader.read()
        assert (reader.asking, reader.running) == (2, 1)


def test_executor_with_failed_idle_still_executes(rig):
    class Restless(Puppet):
        def idle(self):
            raise ZeroDivisionError("nothing to do")

        def close(self):
            raise OSError("stuck")

    skills = rig.skills()
    puppet = rig.puppet("r1", "e1", Restless)
    rig.loop(3)
    master = skills.request(call())
    puppet.ends.append(None)
    rig.until(lambda: master.is_over)
    assert states(master) == ["SUCCEEDED"]
    failures = [line for line in rig.lines if "nothing to do" in line]
    assert failures == ["E e1: idle() failed and will not be called again: ZeroDivisionError: nothing to do"]
    rig.kill("e1")
    assert rig.lines[-1] == "E e1: close() failed: OSError: stuck"


def test_executor_is_asked_again_for_next_master(rig):
    skills, silent = rig.skills(timeouts=Timeouts(start=0.5)), Silent(rig)
    rig.loop()
    first = skills.request(call())
    rig.loop(5)
    second = skills.request(call())
    assert silent.types() == ["Request"]
    rig.until(lambda: first.is_over, loops=20)
    (request,) = silent.messages()
    assert (request.type, request.master) == ("RequestMessage", second.number)
