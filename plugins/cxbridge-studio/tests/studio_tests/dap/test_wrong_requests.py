"""Each request with wrong arguments, and in each wrong phase, is an error."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import pytest

from cxbridge_studio.dap.adapter import Adapter
from cxbridge_studio.dap.wire import Wire
from studio_tests.dap.client import Client
from studio_tests.dap.conftest import GOALS, find_line
from tests.support import ROOT

ROOT_RULE_LINE = find_line(GOALS, "(defrule talk-root-goes-on")
THREAD = {"threadId": 1}
VALID: dict[str, dict[str, Any]] = {
    "initialize": {},
    "launch": {"scenario": "test-scenario"},
    "configurationDone": {},
    "setBreakpoints": {"source": {"path": str(GOALS)}},
    "setFunctionBreakpoints": {"breakpoints": []},
    "setExceptionBreakpoints": {"filters": []},
    "threads": {},
    "stackTrace": THREAD,
    "scopes": {"frameId": 1},
    "variables": {"variablesReference": 1},
    "setVariable": {"variablesReference": 1, "name": "x", "value": "1"},
    "evaluate": {"expression": "1"},
    "stepInTargets": {"frameId": 1},
    **dict.fromkeys(("continue", "stepIn", "next", "stepOut", "pause"), THREAD),
    "terminate": {},
}
"""The required arguments of each request."""


def enter_phase(client, phase):
    """Bring a session into a phase."""
    if phase == "ready":
        client.request("initialize", adapterID="cxbridge")
    elif phase == "stopped":
        client.launch_to_line(GOALS, ROOT_RULE_LINE)
    elif phase != "new":
        client.launch(scenario="test-scenario", **({"clock": "real"} if phase == "running" else {}))
    if phase in ("running", "over"):
        client.start_run()
        client.wait_for_event("thread" if phase == "running" else "terminated")


PHASES = ["new", "ready", "launched", "running", "stopped", "over"]


SETTINGS = {"setBreakpoints", "setFunctionBreakpoints", "setExceptionBreakpoints"}
AFTER_LAUNCH = SETTINGS | {"threads", "terminate"}
ALLOWED = {
    "new": {"initialize"},
    "ready": SETTINGS | {"launch"},
    "launched": AFTER_LAUNCH | {"configurationDone"},
    "running": AFTER_LAUNCH | {"pause"},
    "stopped": AFTER_LAUNCH
    | {"stackTrace", "scopes", "variables", "setVariable", "evaluate", "stepInTargets"}
    # these end the stop; see test_run.py
    | {"continue", "next", "stepIn", "stepOut"},
    "over": AFTER_LAUNCH,
}


@pytest.mark.parametrize("phase", PHASES)
def test_requests_are_invalid_in_wrong_phase(client, phase):
    assert {*VALID, "disconnect"} == Adapter(Wire(BytesIO(), BytesIO()))._handlers.keys()
    enter_phase(client, phase)
    requests = [(name, arguments) for name, arguments in VALID.items() if name not in ALLOWED[phase]]
    requests += [("fly", {})]
    for request, response in zip(requests, client.get_responses(requests), strict=True):
        assert not response["success"], request
        assert any(reason in response["message"] for reason in ("is invalid now", "no request 'fly'")), (
            response
        )
    for command in sorted(ALLOWED[phase] & SETTINGS):
        client.request(command, **VALID[command])


def test_wrong_arguments_are_errors(client):
    enter_phase(client, "stopped")
    requests: list[tuple[str, Any]] = []
    for command, arguments in VALID.items():  # `terminate` is last, because it always ends the run
        requests.append((command, 3))
        for name, value in arguments.items() if command != "launch" else ():
            remaining = {key: arguments[key] for key in arguments if key != name}
            requests += [(command, remaining), (command, {**remaining, name: "x" if value == 1 else 3})]
    for request, response in zip(requests, client.get_responses(requests), strict=True):
        assert not response["success"], request
        assert response["message"].startswith("the arguments are invalid: "), response


@pytest.mark.parametrize("number", [0, 2])
def test_unknown_thread_is_an_error(stopped_client, number):
    for command in ("stackTrace", "continue", "stepIn", "next", "stepOut"):
        assert f"no thread {number}" in stopped_client.get_response(command, threadId=number)["message"]


@pytest.fixture(scope="module")
def stopped_client():
    with Client(ROOT) as client:
        enter_phase(client, "stopped")
        yield client


@pytest.mark.parametrize(
    ("command", "arguments", "message"),
    [
        ("scopes", {"frameId": 0}, "no frame 0"),
        ("scopes", {"frameId": 99}, "no frame 99"),
        ("stepInTargets", {"frameId": 99}, "no frame 99"),
        ("evaluate", {"expression": "1", "frameId": 99}, "no frame 99"),
        ("variables", {"variablesReference": 0}, "the reference 0"),
        ("variables", {"variablesReference": 9999}, "the reference 9999"),
        ("setVariable", {"variablesReference": 9999, "name": "x", "value": "1"}, "the reference 9999"),
        ("stepIn", {"threadId": 1, "targetId": 99}, "no target 99"),
        ("setBreakpoints", {"source": {"path": "/nowhere/at/all"}}, "the file cannot be read"),
        ("setBreakpoints", {"source": {}}, "the file cannot be read"),
        ("setExceptionBreakpoints", {"filters": ["often"]}, "no filter 'often'"),
        ("evaluate", {"expression": ""}, "expression"),
        ("evaluate", {"expression": "(+ 1"}, ""),
    ],
)
def test_unknown_references_are_errors(stopped_client, command, arguments, message):
    response = stopped_client.get_response(command, **arguments)
    assert not response["success"], response
    assert message in response["message"]
    assert "fault" not in response["message"]


def test_launch_with_invalid_flag_is_an_error(client):
    client.request("initialize", adapterID="cxbridge")
    response = client.get_response("launch", scenario="test-scenario", stopOnEntry="false")
    assert response["message"] == "the arguments are invalid: Expected `bool`, got `str` - at `$.stopOnEntry`"


NAMES = {
    "goal:TALK:FINISHD": "FINISHED",
    "goal:TALK:FAILED": "use goal:TALK:*:FAILED",
    "action:say-hello:RUNING": "RUNNING",
    "skill:sey": "say",
    "skill:say:S_FINAAL": "S_FINAL",
    "rule:talk-root-goes-onn": "talk-root-goes-on",
    "after:nothing-like-it": "there is no rule",
    "TALK": "is not a breakpoint",
    "goal:TALK hit often": "is not a hit count",
}


def test_breakpoints_with_unknown_names_are_unverified(client):
    client.launch(scenario="test-scenario", stopOnEntry=True)
    before = client.set_named_breakpoints(*NAMES)
    client.set_line_breakpoints(GOALS, ROOT_RULE_LINE)
    client.start_run()
    client.wait_for_stop()
    client.resume()
    changes = [event["body"]["breakpoint"] for event in client.log if event.get("event") == "breakpoint"]
    changes_by_id = {row["id"]: row for row in changes}
    for first, (name, hint) in zip(before, NAMES.items(), strict=True):
        breakpoint_ = changes_by_id.get(first["id"], first)
        assert (breakpoint_["verified"], hint in breakpoint_["message"]) == (False, True), (name, breakpoint_)
    after_start = client.set_named_breakpoints(*NAMES, "goal:TALK", "rule:talk-*")
    assert [row["verified"] for row in after_start] == [False] * len(NAMES) + [True, True]
    assert all(hint in row["message"] for row, hint in zip(after_start, NAMES.values(), strict=False))


def test_named_breakpoint_has_condition_and_count(client):
    client.launch(scenario="test-scenario")
    count, spaced, condition = client.request(
        "setFunctionBreakpoints",
        breakpoints=[
            {"name": "goal:TALK", "hitCondition": "often"},
            {"name": "goal:TALK", "hitCondition": "> 1"},
            {"name": "goal:TALK:FINISHED", "condition": "FALSE"},
        ],
    )["breakpoints"]
    assert [row["verified"] for row in (count, spaced, condition)] == [False, True, True]
    client.start_run()
    assert client.wait_for_stop()["hitBreakpointIds"] == [spaced["id"]]
