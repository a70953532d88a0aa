"""Each request with wrong arguments, and in each wrong phase: each is an error."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import pytest

from cxbridge_studio.dap.adapter import Adapter
from cxbridge_studio.dap.wire import Wire
from studio_tests.dap.client import Client
from studio_tests.dap.conftest import GOALS, line_of
from tests.support import ROOT

GOES_ON = line_of(GOALS, "(defrule talk-root-goes-on")
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


def everywhere(client, phase):
    """Bring a session into a phase."""
    if phase == "ready":
        client.ask("initialize", adapterID="cxbridge")
    elif phase == "stopped":
        client.stop_at(GOALS, GOES_ON)
    elif phase != "new":
        client.launch(scenario="test-scenario", **({"clock": "real"} if phase == "running" else {}))
    if phase in ("running", "over"):
        client.begin()
        client.event("thread" if phase == "running" else "terminated")


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
    # continuing ends the stop; see test_run.py
    | {"continue", "next", "stepIn", "stepOut"},
    "over": AFTER_LAUNCH,
}


@pytest.mark.parametrize("phase", PHASES)
def test_requests_in_another_phase(client, phase):
    assert {*VALID, "disconnect"} == Adapter(Wire(BytesIO(), BytesIO()))._handlers.keys()
    everywhere(client, phase)
    requests = [(name, arguments) for name, arguments in VALID.items() if name not in ALLOWED[phase]]
    requests += [("fly", {})]
    for request, answer in zip(requests, client.answers(requests), strict=True):
        assert not answer["success"], request
        assert any(why in answer["message"] for why in ("is invalid now", "no request 'fly'")), answer
    for command in sorted(ALLOWED[phase] & SETTINGS):
        client.ask(command, **VALID[command])


def test_wrong_arguments(client):
    everywhere(client, "stopped")
    requests: list[tuple[str, Any]] = []
    for command, arguments in VALID.items():  # at the end `terminate`, which ends the run in any case
        requests.append((command, 3))
        for name, value in arguments.items() if command != "launch" else ():
            others = {other: arguments[other] for other in arguments if other != name}
            requests += [(command, others), (command, {**others, name: "x" if value == 1 else 3})]
    for request, answer in zip(requests, client.answers(requests), strict=True):
        assert not answer["success"], request
        assert answer["message"].startswith("the arguments are invalid: "), answer


@pytest.mark.parametrize("number", [0, 2])
def test_unknown_threads(stopped, number):
    for command in ("stackTrace", "continue", "stepIn", "next", "stepOut"):
        assert f"no thread {number}" in stopped.answer(command, threadId=number)["message"]


@pytest.fixture(scope="module")
def stopped():
    with Client(ROOT) as client:
        everywhere(client, "stopped")
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
def test_references_that_there_are_not(stopped, command, arguments, message):
    answer = stopped.answer(command, **arguments)
    assert not answer["success"], answer
    assert message in answer["message"]
    assert "fault" not in answer["message"]


def test_a_launch_with_an_invalid_flag(client):
    client.ask("initialize", adapterID="cxbridge")
    answer = client.answer("launch", scenario="test-scenario", stopOnEntry="false")
    assert answer["message"] == "the arguments are invalid: Expected `bool`, got `str` - at `$.stopOnEntry`"


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


def test_breakpoints_with_names_that_there_are_not(client):
    client.launch(scenario="test-scenario", stopOnEntry=True)
    before = client.break_on(*NAMES)
    client.break_at(GOALS, GOES_ON)
    client.begin()
    client.stopped()
    client.go()
    told = [event["body"]["breakpoint"] for event in client.log if event.get("event") == "breakpoint"]
    late = {each["id"]: each for each in told}
    for first, (name, hint) in zip(before, NAMES.items(), strict=True):
        shown = late.get(first["id"], first)
        assert (shown["verified"], hint in shown["message"]) == (False, True), (name, shown)
    again = client.break_on(*NAMES, "goal:TALK", "rule:talk-*")
    assert [each["verified"] for each in again] == [False] * len(NAMES) + [True, True]
    assert all(hint in each["message"] for each, hint in zip(again, NAMES.values(), strict=False))


def test_a_condition_and_a_count_beside_the_name(client):
    client.launch(scenario="test-scenario")
    count, spaced, condition = client.ask(
        "setFunctionBreakpoints",
        breakpoints=[
            {"name": "goal:TALK", "hitCondition": "often"},
            {"name": "goal:TALK", "hitCondition": "> 1"},
            {"name": "goal:TALK:FINISHED", "condition": "FALSE"},
        ],
    )["breakpoints"]
    assert [each["verified"] for each in (count, spaced, condition)] == [False, True, True]
    client.begin()
    assert client.stopped()["hitBreakpointIds"] == [spaced["id"]]
