"""The hubs of PlanSys2 and of the thesis, on nodes of this process, with each failure."""

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
from ros2_tests.hub import CALLER, CALLERS, PERFORMER, HubPeer, LocalWorld, Side

MOVE = ActionKey("move", ("r2", "hall"))
SUCCEEDED = ("SUCCEEDED", "")


@pytest.fixture(params=CALLERS)
def protocol(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> Iterator[LocalWorld]:
    world = LocalWorld(monkeypatch.setattr)
    yield world
    world.close()


def add_performer(world: LocalWorld, protocol: str, text: str = PERFORMER) -> Side:
    return world.add_side(text, PROTOCOL=protocol)


@pytest.fixture
def caller(world: LocalWorld, protocol: str) -> Side:
    return world.add_side(CALLER, CLASS=CALLERS[protocol])


@pytest.fixture
def performer(world: LocalWorld, protocol: str) -> Side:
    return add_performer(world, protocol)


@pytest.fixture
def hub_peer(world: LocalWorld, protocol: str) -> HubPeer:
    return world.add_peer(protocol)


def filter_skill_lines(side: Side) -> list[str]:
    return [line for line in side.lines if " {'" in line]


# --- our caller and our performer -------------------------------------------------------------------------


def test_performer_executes_skill_of_caller(world: LocalWorld, caller: Side, performer: Side):
    feedback = []
    master = caller.service.local_calls.request(
        "move", {"robot": "r2", "to": "hall"}, "robot1", lambda master: feedback.append(master.feedback)
    )
    assert world.wait_for_ends(master) == [SUCCEEDED]
    assert "move {'1': 'r2', '2': 'hall'}" in performer.lines
    assert any(each.startswith("step ") for each in feedback)
    assert (master.feedback, master.progress) == ("arrived", 1.0)


def test_callers_use_same_executor_in_turn(world: LocalWorld, protocol: str, caller: Side, performer: Side):
    second = world.add_side(CALLER, CLASS=CALLERS[protocol])
    assert world.wait_for_ends(caller.request_skill("move", "a"), second.request_skill("wave", "b")) == [
        SUCCEEDED,
        SUCCEEDED,
    ]
    assert sorted(filter_skill_lines(performer)) == ["move {'1': 'a'}", "wave {'1': 'b'}"]


# --- our performer and a foreign caller -------------------------------------------------------------------


def test_repeated_request_is_executed_once(performer: Side, hub_peer: HubPeer):
    hub_peer.send(MessageKind.REQUEST, MOVE)
    hub_peer.receive(MessageKind.RESPONSE)
    hub_peer.request_and_confirm(MOVE)
    hub_peer.send(MessageKind.CONFIRM, MOVE, "ours_move")
    hub_peer.send(MessageKind.REJECT, MOVE, "ours_move")  # the answer of PlanSys2 to the second RESPONSE
    hub_peer.receive(MessageKind.FEEDBACK)
    end = hub_peer.receive(MessageKind.FINISH)
    assert (end.success, end.status, end.node) == (True, "arrived", "ours_move")
    assert hub_peer.receives_none(MessageKind.FINISH)
    assert filter_skill_lines(performer) == ["move {'1': 'r2', '2': 'hall'}"]


def test_response_is_repeated_until_confirmation(performer: Side, hub_peer: HubPeer):
    hub_peer.send(MessageKind.REQUEST, MOVE)
    hub_peer.receive(MessageKind.RESPONSE)
    hub_peer.receive(MessageKind.RESPONSE, limit_s=0.6)
    hub_peer.send(MessageKind.CONFIRM, MOVE, "another")
    assert hub_peer.receives_none(MessageKind.RESPONSE, loops=50)


def test_rejected_performer_answers_next_request(performer: Side, hub_peer: HubPeer):
    hub_peer.send(MessageKind.REQUEST, MOVE)
    hub_peer.receive(MessageKind.RESPONSE)
    next_key = ActionKey("wave", ("x",))
    hub_peer.send(MessageKind.REQUEST, next_key)
    assert hub_peer.receives_none(MessageKind.RESPONSE)  # the only executor is reserved
    hub_peer.send(MessageKind.REJECT, MOVE, "ours_move")
    assert hub_peer.receive(MessageKind.RESPONSE, limit_s=0.5).key == next_key


def test_unconfirmed_performer_answers_requests_after_timeout(
    world: LocalWorld, performer: Side, hub_peer: HubPeer
):
    hub_peer.send(MessageKind.REQUEST, MOVE)
    hub_peer.receives_none(loops=150)
    hub_peer.messages.clear()
    next_key = ActionKey("move", ("x",))
    hub_peer.send(MessageKind.REQUEST, next_key)
    assert hub_peer.receive(MessageKind.RESPONSE, limit_s=0.5).key == next_key
    hub_peer.send(MessageKind.CONFIRM, MOVE, "ours_move")  # a late CONFIRM is valid
    assert hub_peer.receive(MessageKind.FINISH).success


def test_wrong_number_of_arguments_fails_request(world: LocalWorld, protocol: str, hub_peer: HubPeer):
    text = PERFORMER.replace("actions: [move, wave]", "actions: {move: {parameters: [robot]}}")
    add_performer(world, protocol, text)
    hub_peer.request_and_confirm(MOVE)
    end = hub_peer.receive(MessageKind.FINISH)
    assert (end.success, end.status) == (False, "(move r2 hall) has 2 arguments, but move has 1")


def test_missing_action_or_skill_gets_no_response(world: LocalWorld, protocol: str, hub_peer: HubPeer):
    add_performer(world, protocol, PERFORMER.replace("[move, wave]", "[move, fly]"))
    for key in (ActionKey("wave", ()), ActionKey("fly", ())):
        hub_peer.send(MessageKind.REQUEST, key)
    assert hub_peer.receives_none(MessageKind.RESPONSE, loops=80)
    assert {(each.node, each.state) for each in hub_peer.heartbeats} == {
        ("ours_move", PerformerState.READY),
        ("ours_fly", PerformerState.NOT_READY),
    }


def test_template_passes_numbers_to_skill(world: LocalWorld, protocol: str, hub_peer: HubPeer):
    actions = "actions: {move: {parameters: [robot, times], call: 'count{times=?(times)i, who=?(robot)s}'}}"
    performer = add_performer(world, protocol, PERFORMER.replace("actions: [move, wave]", actions))
    hub_peer.request_and_confirm(ActionKey("move", ("r2", "3")))
    assert hub_peer.receive(MessageKind.FINISH).success
    assert "count {'times': 3, 'who': 'r2'}" in performer.lines


def test_action_without_parameters_calls_skill_without_parameters(
    protocol: str, performer: Side, hub_peer: HubPeer
):
    # the arguments that PlanSys2's executor and the master of the thesis send for no parameters
    key = ActionKey("wave", ("wave",) if protocol == "plansys2" else ("",))
    hub_peer.request_and_confirm(key, "ours_wave")
    assert hub_peer.receive(MessageKind.FINISH).key == key
    assert "wave {}" in performer.lines


def test_cancelled_performer_answers_like_original(protocol: str, performer: Side, hub_peer: HubPeer):
    key = ActionKey("move", ("long",))
    hub_peer.request_and_confirm(key)
    hub_peer.receive(MessageKind.FEEDBACK)
    hub_peer.send(MessageKind.CANCEL, key, "ours_move")
    if protocol == "plansys2":
        assert hub_peer.receives_none(MessageKind.FINISH)
    else:
        end = hub_peer.receive(MessageKind.FINISH)
        assert (end.success, end.status, end.progress) == (False, "CANCELLED", 0.0)
    assert "move was stopped" in performer.lines


def test_closed_performer_fails_its_action(performer: Side, hub_peer: HubPeer):
    hub_peer.request_and_confirm(ActionKey("move", ("long",)))
    hub_peer.receive(MessageKind.FEEDBACK)
    performer.performers.pop().close()
    end = hub_peer.receive(MessageKind.FINISH)
    assert (end.success, end.status) == (False, "the performer ours_move was shut down")


@pytest.mark.parametrize("protocol", ["skill-execution"])
def test_skill_gets_mapped_action_of_request(world: LocalWorld, protocol: str, hub_peer: HubPeer):
    text = PERFORMER.replace("actions: [move, wave]", "actions: {wave: {parameters: [to]}}")
    performer = add_performer(world, protocol, text)
    hub_peer.request_and_confirm(ActionKey("wave", ("y",)), "ours_wave", skill_string="count{times=2}")
    hub_peer.receive(MessageKind.FINISH)
    assert "wave {'to': 'y', 'mapped_action': 'count{times=2}'}" in performer.lines


# --- our caller and a foreign performer -------------------------------------------------------------------


@pytest.fixture
def master(caller: Side, hub_peer: HubPeer) -> Master:
    """Request a skill that the hub peer may perform."""
    return caller.request_skill("move", "r2", "hall")


def test_unanswered_request_is_repeated(world: LocalWorld, hub_peer: HubPeer, master: Master):
    hub_peer.receive(MessageKind.REQUEST)
    key = hub_peer.accept_request()
    hub_peer.send(MessageKind.FINISH, key, success=True, status="done")
    assert world.wait_for_ends(master) == [SUCCEEDED]
    assert (master.feedback, key.arguments) == ("done", ("r2", "hall"))


def test_second_and_late_responses_are_rejected(
    world: LocalWorld, protocol: str, hub_peer: HubPeer, master: Master
):
    second, key = world.add_peer(protocol, "second"), hub_peer.accept_request()
    second.send(MessageKind.RESPONSE, key)
    second.receive(MessageKind.REJECT, "second")
    hub_peer.send(MessageKind.FINISH, key, success=True)
    second.send(MessageKind.FEEDBACK, key, status="wrong")
    assert world.wait_for_ends(master) == [SUCCEEDED]
    second.send(MessageKind.RESPONSE, key)
    second.receive(MessageKind.REJECT, "second")
    second.send(MessageKind.REQUEST, key, "third")  # the request of a new caller
    second.send(MessageKind.RESPONSE, key)
    assert second.receives_none(MessageKind.REJECT, MessageKind.CONFIRM)


def test_ready_performer_without_response_is_rejected(world: LocalWorld, hub_peer: HubPeer, master: Master):
    # after the loss of its RESPONSE, the performer reports READY and answers no request
    for _ in range(30):
        hub_peer.send_heartbeat(PerformerState.READY)
        world.loop(5)
    hub_peer.receive(MessageKind.REJECT, "peer")
    hub_peer.send(MessageKind.FINISH, hub_peer.accept_request(), success=True)
    assert world.wait_for_ends(master) == [SUCCEEDED]


def test_missing_performer_fails_skill_and_names_hub(world: LocalWorld, protocol: str, master: Master):
    begin_us = world.clock.now_us()
    topic = "/actions_hub" if protocol == "plansys2" else "/skill_board"
    assert world.wait_for_ends(master) == [("FAILED", f"no performer of (move r2 hall) answers on {topic}")]
    seconds = (world.clock.now_us() - begin_us) / 1e6
    assert abs(seconds - PROTOCOLS[protocol].server_timeout_s) < 0.2


def test_vanished_performer_fails_skill(world: LocalWorld, hub_peer: HubPeer, master: Master):
    key = hub_peer.accept_request()
    for _ in range(10):
        hub_peer.send_heartbeat(PerformerState.RUNNING)
        hub_peer.send(MessageKind.FEEDBACK, key, progress=0.5, status="half")
        world.loop(50)
    assert (master.progress, master.feedback) == (0.5, "half")
    assert world.wait_for_ends(master) == [("FAILED", "the performer peer has vanished")]


def test_performer_without_heartbeats_may_be_silent(world: LocalWorld, hub_peer: HubPeer, master: Master):
    key = hub_peer.accept_request()
    hub_peer.send(MessageKind.FEEDBACK, key, progress=0.5)
    world.loop(1000)
    hub_peer.send(MessageKind.FINISH, key, success=True)
    assert world.wait_for_ends(master) == [SUCCEEDED]


def test_restarted_performer_fails_skill(world: LocalWorld, hub_peer: HubPeer, master: Master):
    hub_peer.accept_request()
    ready, running = PerformerState.READY, PerformerState.RUNNING
    for state in (ready, running, ready, running, ready, ready):
        assert not master.is_over
        hub_peer.send_heartbeat(state)
        world.loop(50)
    ((end, error),) = world.wait_for_ends(master)
    assert (end, error.partition(",")[0]) == ("FAILED", "peer no longer performs the action")


def test_response_after_cancel_is_rejected(
    world: LocalWorld, caller: Side, hub_peer: HubPeer, master: Master
):
    key = hub_peer.receive(MessageKind.REQUEST).key
    caller.service.local_calls.cancel(master.number)
    world.wait_for_ends(master)
    hub_peer.send(MessageKind.RESPONSE, key)
    hub_peer.receive(MessageKind.REJECT, "peer")
    assert hub_peer.receives_none(MessageKind.CANCEL)


@pytest.mark.parametrize("protocol", ["skill-execution"])
def test_request_has_configured_arguments(world: LocalWorld, protocol: str, hub_peer: HubPeer):
    skills = """skills: {move: {action: go, arguments: ["$to", "at ${speed}"]}}"""
    caller = world.add_side(CALLER.replace("skills: [move, wave]", skills), CLASS=CALLERS[protocol])
    caller.request_skill("move", to=4, speed=1.5)
    assert hub_peer.receive(MessageKind.REQUEST).key == ActionKey("go", ("4", "at 1.5"))


@pytest.mark.parametrize("protocol", ["skill-execution"])
def test_messages_have_mapped_action_of_thesis(caller: Side, hub_peer: HubPeer):
    caller.service.local_calls.request(
        "move", {"1": "r2", "2": "hall", "mapped_action": "go()"}, "robot1", lambda _master: None, "move_gen1"
    )
    request = hub_peer.receive(MessageKind.REQUEST)
    assert (request.node, request.key, request.skill_string) == ("move_gen1", MOVE, "go()")
    hub_peer.send(MessageKind.RESPONSE, request.key, skill_string=request.skill_string)
    assert hub_peer.receive(MessageKind.CONFIRM).skill_string == "go()"


def test_skill_is_cancelled_after_timeout(world: LocalWorld, protocol: str, hub_peer: HubPeer):
    text = CALLER.replace("skills: [move, wave]", "skills: {move: {timeout: 3}}")
    master = world.add_side(text, CLASS=CALLERS[protocol]).request_skill("move", "r2", "hall")
    hub_peer.accept_request()
    ((state, error),) = world.wait_for_ends(master)
    assert state == "FAILED"
    assert error.endswith("has not ended within 3 s")
    hub_peer.receive(MessageKind.CANCEL, "peer")


# --- configurations ---------------------------------------------------------------------------------------

INVALID_CALLERS = {
    "no skills": ("", "PlanSys2Skills has no skills"),
    "unknown key": (", skills: {move: {argument: 1}}", "the skill move has no setting 'argument'"),
    "timeout": (", skills: {move: {timeout: no}}", "must be a positive number of seconds"),
    "relative namespace": (", skills: [move], namespace: robot1", "is not an absolute name"),
}


@pytest.mark.parametrize("case", INVALID_CALLERS)
def test_invalid_caller_settings_are_refused(world: LocalWorld, case: str):
    setting, message = INVALID_CALLERS[case]
    text = CALLER.replace(", skills: [move, wave]", setting)
    with pytest.raises(CxbridgeError, match=message) as caught:
        world.add_side(text, CLASS=CALLERS["plansys2"])
    assert caught.value.file is not None


INVALID_PERFORMERS = {
    "no protocol": ("agent: robot2, actions: [move]", "has the unknown protocol ''"),
    "misspelt protocol": ("protocol: plansys3, actions: [move]", "did you mean plansys2"),
    "no actions": ("protocol: plansys2", "has no actions"),
    "ambiguous agent": ("protocol: plansys2, actions: [move]", "the performer hub must name an agent"),
    "unknown agent": (
        "protocol: plansys2, actions: [move], agent: robot3",
        "serves the unknown agent 'robot3'",
    ),
    "unknown key": ("protocol: plansys2, action: [move]", "did you mean actions"),
    "unknown key of action": ("protocol: plansys2, actions: {move: {names: [a]}}", "has no setting 'names'"),
    "invalid template": (
        "protocol: plansys2, actions: {move: {call: 'go{to=?(to)x}'}}",
        r"the call of the action move: .*is kept as text",
    ),
}


@pytest.mark.parametrize("case", INVALID_PERFORMERS)
def test_invalid_performer_settings_are_refused_with_place(case: str, tmp_path: Any):
    settings, message = INVALID_PERFORMERS[case]
    config = Configuration.from_text(
        f"ros2:\n  performers:\n    hub: {{{settings}}}\n", str(tmp_path / "a.yaml")
    )
    agents = ["robot1", "robot2"] if case == "ambiguous agent" else ["robot2"]
    with pytest.raises(CxbridgeError, match=message) as caught:
        read_performer_settings(config, agents, tmp_path)
    assert caught.value.line == 3
