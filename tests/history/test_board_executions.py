"""The history has the executions of a skill board, and the arguments of planned actions."""

from __future__ import annotations

from msgspec.structs import replace

from cxbridge.events import InterfaceMessage, PlanActionTransition, PlannerCall
from cxbridge.history.builder import RunHistory

BOARD, EXECUTOR = "SkillBoardInterface::SkillBoard", "SkillExecutorInterface::e1"


def message(time_us, uid, kind, **values):
    ticket = {"board": "SkillBoard", "epoch": 1, "master": 7, "executor": "e1"}
    return InterfaceMessage(time_us, uid, f"{kind}Message", 1, "", "queued", {**ticket, **values})


def exchange(outcome="SUCCEEDED", error=""):
    return [
        message(0, EXECUTOR, "Request", agent="robot1", skill="move", parameters='{"1": "tb3", "2": "wp1"}'),
        message(1, BOARD, "Response"),
        message(2, EXECUTOR, "Confirm"),
        message(3, BOARD, "Feedback", progress=0.25, text="running"),
        message(4, BOARD, "Feedback", progress=0.5, text="half"),
        message(5, BOARD, "Finish", outcome=outcome, error=error),
    ]


def test_execution_has_agent_and_feedback():
    (call,) = RunHistory.from_events(exchange()).calls
    assert call.skiller == "e1"
    assert call.skill_string == "move tb3 wp1 of robot1: 2 feedback messages, the last: 50% half"
    assert (call.begin[1], call.end, call.status, call.error) == (2, (5, 5), "S_FINAL", "")


def test_failed_execution_has_error():
    (call,) = RunHistory.from_events(exchange("FAILED", "door closed")).calls
    assert (call.status, call.error) == ("S_FAILED", "door closed")


def test_running_execution_has_no_end():
    (call,) = RunHistory.from_events(exchange()[:-1]).calls
    assert (call.status, call.end) == ("S_RUNNING", None)


def test_execution_ends_when_executor_begins_next():
    first, second = RunHistory.from_events([*exchange()[:-1], *exchange()[:-1]]).calls
    assert (first.status, first.end) == ("stopped", second.begin)
    assert (second.status, second.end) == ("S_RUNNING", None)


def test_refused_request_does_not_end_execution():
    next_request = [
        message(4, EXECUTOR, "Request", skill="lift", parameters="{}"),
        message(4, BOARD, "Finish", outcome="REFUSED"),
    ]
    refused = [replace(event, values={**event.values, "master": 8}) for event in next_request]
    begun, finished = exchange()[:-1], exchange()[-1:]
    (call,) = RunHistory.from_events([*begun, *refused, *finished]).calls
    assert (call.status, call.end and call.end[1]) == ("S_FINAL", 5)


def test_execution_begun_before_recording_is_no_call():
    """The skill is unknown; each feedback message made a call before."""
    assert RunHistory.from_events(exchange()[1:]).calls == []


def test_actions_have_arguments_of_plan():
    plan = "(move tb3 here there)\n0.5: (wait) [1.0]"
    history = RunHistory.from_events(
        [
            PlanActionTransition(0, "e", "1", "G", "P", "move", "FORMULATED"),
            PlanActionTransition(0, "e", "2", "G", "P", "wait", "FORMULATED"),
            PlannerCall(0, "e", "P", "G", "pyperplan", "d", "(goal)", "found", 1, 2, "", plan),
        ]
    )
    assert [action.text for action in history.actions] == ["move tb3 here there", "wait"]
