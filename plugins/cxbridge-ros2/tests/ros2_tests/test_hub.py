"""The hubs of PlanSys2 and of the thesis, on nodes of this process: each failure, step by step."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("rosbags", reason="the extra ros2 is not installed")

from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError
from cxbridge.skiller.board.master import Master
from cxbridge_ros2.hub.protocol import ActionKey, MessageKind, PerformerState
from cxbridge_ros2.hub.settings import PROTOCOLS, read_performer_settings
from ros2_tests.hub import CALLER, CALLERS, PERFORMER, LocalWorld, Side, Stranger

MOVE = ActionKey("move", ("r2", "hall"))
THERE = ("SUCCEEDED", "")


@pytest.fixture(params=CALLERS)
def protocol(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> Iterator[LocalWorld]:
    world = LocalWorld(monkeypatch.setattr)
    yield world
    world.close()


def performer(world: LocalWorld, protocol: str, text: str = PERFORMER) -> Side:
    return world.side(text, PROTOCOL=protocol)


@pytest.fixture
def here(world: LocalWorld, protocol: str) -> Side:
    return world.side(CALLER, CLASS=CALLERS[protocol])


@pytest.fixture
def there(world: LocalWorld, protocol: str) -> Side:
    return performer(world, protocol)


@pytest.fixture
def stranger(world: LocalWorld, protocol: str) -> Stranger:
    return world.stranger(protocol)


def moves(side: Side) -> list[str]:
    return [line for line in side.lines if " {'" in line]


# --- both sides are ours --------------------------------------------------------------------------------


def test_a_skill_is_executed_by_others(world: LocalWorld, here: Side, there: Side):
    told = []
    master = here.service.local_calls.ask(
        "move", {"robot": "r2", "to": "hall"}, "robot1", lambda master: told.append(master.feedback)
    )
    assert world.over(master) == [THERE]
    assert "move {'1': 'r2', '2': 'hall'}" in there.lines
    assert any(each.startswith("step ") for each in told)
    assert (master.feedback, master.progress) == ("there", 1.0)


def test_two_that_want_the_same_executor_get_it_one_after_the_other(
    world: LocalWorld, protocol: str, here: Side, there: Side
):
    two = world.side(CALLER, CLASS=CALLERS[protocol])
    assert world.over(here.ask("move", "a"), two.ask("wave", "b")) == [THERE, THERE]
    assert sorted(moves(there)) == ["move {'1': 'a'}", "wave {'1': 'b'}"]


# --- our skills, and a stranger that asks -----------------------------------------------------------------


def test_a_repeated_request_is_answered_again_and_done_once(there: Side, stranger: Stranger):
    stranger.say(MessageKind.REQUEST, MOVE)
    stranger.hear(MessageKind.RESPONSE)
    stranger.begin(MOVE)
    stranger.say(MessageKind.CONFIRM, MOVE, "ours_move")
    stranger.say(MessageKind.REJECT, MOVE, "ours_move")  # as PlanSys2 answers to the second RESPONSE
    stranger.hear(MessageKind.FEEDBACK)
    end = stranger.hear(MessageKind.FINISH)
    assert (end.success, end.status, end.node) == (True, "there", "ours_move")
    assert stranger.silent(MessageKind.FINISH)
    assert moves(there) == ["move {'1': 'r2', '2': 'hall'}"]


def test_a_lost_answer_is_repeated_until_somebody_is_confirmed(there: Side, stranger: Stranger):
    stranger.say(MessageKind.REQUEST, MOVE)
    stranger.hear(MessageKind.RESPONSE)
    stranger.hear(MessageKind.RESPONSE, limit_s=0.6)
    stranger.say(MessageKind.CONFIRM, MOVE, "another")
    assert stranger.silent(MessageKind.RESPONSE, loops=50)


def test_who_was_rejected_is_free(there: Side, stranger: Stranger):
    stranger.say(MessageKind.REQUEST, MOVE)
    stranger.hear(MessageKind.RESPONSE)
    other = ActionKey("wave", ("x",))
    stranger.say(MessageKind.REQUEST, other)
    assert stranger.silent(MessageKind.RESPONSE)  # its only executor is promised
    stranger.say(MessageKind.REJECT, MOVE, "ours_move")
    assert stranger.hear(MessageKind.RESPONSE, limit_s=0.5).key == other


def test_who_is_neither_confirmed_nor_rejected_is_free_after_a_while(
    world: LocalWorld, there: Side, stranger: Stranger
):
    stranger.say(MessageKind.REQUEST, MOVE)
    stranger.silent(loops=150)
    stranger.heard.clear()
    other = ActionKey("move", ("x",))
    stranger.say(MessageKind.REQUEST, other)
    assert stranger.hear(MessageKind.RESPONSE, limit_s=0.5).key == other
    stranger.say(MessageKind.CONFIRM, MOVE, "ours_move")  # late: it is done nevertheless
    assert stranger.hear(MessageKind.FINISH).success


def test_who_asks_knows_what_does_not_fit(world: LocalWorld, protocol: str, stranger: Stranger):
    text = PERFORMER.replace("actions: [move, wave]", "actions: {move: {parameters: [robot]}}")
    performer(world, protocol, text)
    stranger.begin(MOVE)
    end = stranger.hear(MessageKind.FINISH)
    assert (end.success, end.status) == (False, "(move r2 hall) has 2 arguments, but move has 1")


def test_nobody_answers_for_what_is_not_there(world: LocalWorld, protocol: str, stranger: Stranger):
    performer(world, protocol, PERFORMER.replace("[move, wave]", "[move, fly]"))
    for key in (ActionKey("wave", ()), ActionKey("fly", ())):
        stranger.say(MessageKind.REQUEST, key)
    assert stranger.silent(MessageKind.RESPONSE, loops=80)
    assert {(each.node, each.state) for each in stranger.signs} == {
        ("ours_move", PerformerState.READY),
        ("ours_fly", PerformerState.NOT_READY),
    }


def test_a_template_gives_skills_numbers(world: LocalWorld, protocol: str, stranger: Stranger):
    actions = "actions: {move: {parameters: [robot, times], call: 'count{times=?(times)i, who=?(robot)s}'}}"
    there = performer(world, protocol, PERFORMER.replace("actions: [move, wave]", actions))
    stranger.begin(ActionKey("move", ("r2", "3")))
    assert stranger.hear(MessageKind.FINISH).success
    assert "count {'times': 3, 'who': 'r2'}" in there.lines


def test_an_action_without_parameters_has_none(protocol: str, there: Side, stranger: Stranger):
    # what PlanSys2's executor, and the master of the thesis, make of no parameters
    key = ActionKey("wave", ("wave",) if protocol == "plansys2" else ("",))
    stranger.begin(key, "ours_wave")
    assert stranger.hear(MessageKind.FINISH).key == key
    assert "wave {}" in there.lines


def test_after_cancel_a_performer_says_what_the_original_says(protocol: str, there: Side, stranger: Stranger):
    key = ActionKey("move", ("long",))
    stranger.begin(key)
    stranger.hear(MessageKind.FEEDBACK)
    stranger.say(MessageKind.CANCEL, key, "ours_move")
    if protocol == "plansys2":
        assert stranger.silent(MessageKind.FINISH)
    else:
        end = stranger.hear(MessageKind.FINISH)
        assert (end.success, end.status, end.progress) == (False, "CANCELLED", 0.0)
    assert "move was stopped" in there.lines


def test_the_end_of_a_performer_ends_what_it_does(there: Side, stranger: Stranger):
    stranger.begin(ActionKey("move", ("long",)))
    stranger.hear(MessageKind.FEEDBACK)
    there.performers.pop().close()
    end = stranger.hear(MessageKind.FINISH)
    assert (end.success, end.status) == (False, "the performer ours_move was shut down")


@pytest.mark.parametrize("protocol", ["skill-execution"])
def test_a_mapped_skill_goes_to_the_skill(world: LocalWorld, protocol: str, stranger: Stranger):
    text = PERFORMER.replace("actions: [move, wave]", "actions: {wave: {parameters: [to]}}")
    there = performer(world, protocol, text)
    stranger.begin(ActionKey("wave", ("y",)), "ours_wave", skill_string="count{times=2}")
    stranger.hear(MessageKind.FINISH)
    assert "wave {'to': 'y', 'mapped_action': 'count{times=2}'}" in there.lines


# --- our executive, and a stranger that performs ----------------------------------------------------------


@pytest.fixture
def master(here: Side, stranger: Stranger) -> Master:
    """A skill that is requested, and that strangers may perform."""
    return here.ask("move", "r2", "hall")


def test_a_lost_request_is_repeated(world: LocalWorld, stranger: Stranger, master: Master):
    stranger.hear(MessageKind.REQUEST)
    key = stranger.perform()
    stranger.say(MessageKind.FINISH, key, success=True, status="done")
    assert world.over(master) == [THERE]
    assert (master.feedback, key.arguments) == ("done", ("r2", "hall"))


def test_who_answers_second_or_late_is_rejected(
    world: LocalWorld, protocol: str, stranger: Stranger, master: Master
):
    second, key = world.stranger(protocol, "second"), stranger.perform()
    second.say(MessageKind.RESPONSE, key)
    second.hear(MessageKind.REJECT, "second")
    stranger.say(MessageKind.FINISH, key, success=True)
    second.say(MessageKind.FEEDBACK, key, status="wrong")
    assert world.over(master) == [THERE]
    second.say(MessageKind.RESPONSE, key)
    second.hear(MessageKind.REJECT, "second")
    second.say(MessageKind.REQUEST, key, "a stranger")  # now it is another one's
    second.say(MessageKind.RESPONSE, key)
    assert second.silent(MessageKind.REJECT, MessageKind.CONFIRM)


def test_a_performer_that_waits_in_vain_is_freed(world: LocalWorld, stranger: Stranger, master: Master):
    # its RESPONSE was lost: it reports to be ready, and answers no request
    for _ in range(30):
        stranger.live(PerformerState.READY)
        world.loop(5)
    stranger.hear(MessageKind.REJECT, "stranger")
    stranger.say(MessageKind.FINISH, stranger.perform(), success=True)
    assert world.over(master) == [THERE]


def test_nobody_is_a_failure_that_names_the_hub(world: LocalWorld, protocol: str, master: Master):
    begin_us = world.clock.now_us()
    topic = "/actions_hub" if protocol == "plansys2" else "/skill_board"
    assert world.over(master) == [("FAILED", f"no performer of (move r2 hall) answers on {topic}")]
    seconds = (world.clock.now_us() - begin_us) / 1e6
    assert abs(seconds - PROTOCOLS[protocol].server_timeout_s) < 0.2


def test_a_performer_that_vanishes_is_a_failure(world: LocalWorld, stranger: Stranger, master: Master):
    key = stranger.perform()
    for _ in range(10):
        stranger.live(PerformerState.RUNNING)
        stranger.say(MessageKind.FEEDBACK, key, progress=0.5, status="half")
        world.loop(50)
    assert (master.progress, master.feedback) == (0.5, "half")
    assert world.over(master) == [("FAILED", "the performer stranger has vanished")]


def test_a_performer_without_signs_of_life_may_be_silent(
    world: LocalWorld, stranger: Stranger, master: Master
):
    key = stranger.perform()
    stranger.say(MessageKind.FEEDBACK, key, progress=0.5)
    world.loop(1000)
    stranger.say(MessageKind.FINISH, key, success=True)
    assert world.over(master) == [THERE]


def test_a_performer_that_was_restarted_is_a_failure(world: LocalWorld, stranger: Stranger, master: Master):
    stranger.perform()
    ready, running = PerformerState.READY, PerformerState.RUNNING
    for life in (ready, running, ready, running, ready, ready):
        assert not master.is_over
        stranger.live(life)
        world.loop(50)
    ((state, error),) = world.over(master)
    assert (state, error.partition(",")[0]) == ("FAILED", "stranger no longer performs the action")


def test_cancel_before_anybody_has_answered_rejects_who_answers(
    world: LocalWorld, here: Side, stranger: Stranger, master: Master
):
    key = stranger.hear(MessageKind.REQUEST).key
    here.service.local_calls.stop(master.number)
    world.over(master)
    stranger.say(MessageKind.RESPONSE, key)
    stranger.hear(MessageKind.REJECT, "stranger")
    assert stranger.silent(MessageKind.CANCEL)


@pytest.mark.parametrize("protocol", ["skill-execution"])
def test_arguments_are_as_configured(world: LocalWorld, protocol: str, stranger: Stranger):
    skills = """skills: {move: {action: go, arguments: ["$to", "at ${speed}"]}}"""
    here = world.side(CALLER.replace("skills: [move, wave]", skills), CLASS=CALLERS[protocol])
    here.ask("move", to=4, speed=1.5)
    assert stranger.hear(MessageKind.REQUEST).key == ActionKey("go", ("4", "at 1.5"))


@pytest.mark.parametrize("protocol", ["skill-execution"])
def test_the_mapped_action_of_the_thesis_goes_along(here: Side, stranger: Stranger):
    here.service.local_calls.ask(
        "move", {"1": "r2", "2": "hall", "mapped_action": "go()"}, "robot1", lambda _master: None, "move_gen1"
    )
    request = stranger.hear(MessageKind.REQUEST)
    assert (request.node, request.key, request.skill_string) == ("move_gen1", MOVE, "go()")
    stranger.say(MessageKind.RESPONSE, request.key, skill_string=request.skill_string)
    assert stranger.hear(MessageKind.CONFIRM).skill_string == "go()"


def test_a_skill_takes_no_longer_than_it_may(world: LocalWorld, protocol: str, stranger: Stranger):
    text = CALLER.replace("skills: [move, wave]", "skills: {move: {timeout: 3}}")
    master = world.side(text, CLASS=CALLERS[protocol]).ask("move", "r2", "hall")
    stranger.perform()
    ((state, error),) = world.over(master)
    assert state == "FAILED"
    assert error.endswith("has not ended within 3 s")
    stranger.hear(MessageKind.CANCEL, "stranger")


# --- configurations ---------------------------------------------------------------------------------------

WRONG_CALLERS = {
    "no skills": ("", "PlanSys2Skills has no skills"),
    "an unknown key": (", skills: {move: {argument: 1}}", "the skill move has no setting 'argument'"),
    "a time": (", skills: {move: {timeout: no}}", "must be a positive number of seconds"),
    "a namespace": (", skills: [move], namespace: robot1", "is not an absolute name"),
}


@pytest.mark.parametrize("case", WRONG_CALLERS)
def test_a_wrong_caller_is_one_error(world: LocalWorld, case: str):
    setting, words = WRONG_CALLERS[case]
    text = CALLER.replace(", skills: [move, wave]", setting)
    with pytest.raises(CxbridgeError, match=words) as caught:
        world.side(text, CLASS=CALLERS["plansys2"])
    assert caught.value.file is not None


WRONG_PERFORMERS = {
    "no protocol": ("agent: robot2, actions: [move]", "has the unknown protocol ''"),
    "another protocol": ("protocol: plansys3, actions: [move]", "did you mean plansys2"),
    "no actions": ("protocol: plansys2", "has no actions"),
    "which agent": ("protocol: plansys2, actions: [move]", "the performer hub must name an agent"),
    "no agent": ("protocol: plansys2, actions: [move], agent: robot3", "serves the unknown agent 'robot3'"),
    "an unknown key": ("protocol: plansys2, action: [move]", "did you mean actions"),
    "an action's key": ("protocol: plansys2, actions: {move: {names: [a]}}", "has no setting 'names'"),
    "a template": (
        "protocol: plansys2, actions: {move: {call: 'go{to=?(to)x}'}}",
        r"the call of the action move: .*is kept as text",
    ),
}


@pytest.mark.parametrize("case", WRONG_PERFORMERS)
def test_a_wrong_performer_is_one_error_with_its_place(case: str, tmp_path: Any):
    settings, words = WRONG_PERFORMERS[case]
    config = Configuration.from_text(
        f"ros2:\n  performers:\n    hub: {{{settings}}}\n", str(tmp_path / "a.yaml")
    )
    agents = ["robot1", "robot2"] if case == "which agent" else ["robot2"]
    with pytest.raises(CxbridgeError, match=words) as caught:
        read_performer_settings(config, agents, tmp_path)
    assert caught.value.line == 3
