"""All requests of the protocol with all kinds of wrong arguments, and in all wrong phases: each is an error.

The requests and their arguments are those of the protocol's own schema: see schema.py.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, get_args

import msgspec
import pytest

from cxbridge_studio.dap.adapter import Adapter
from cxbridge_studio.dap.wire import Wire
from studio_tests.dap.client import Client
from studio_tests.dap.conftest import GOALS, line_of
from tests.support import ROOT, share

REQUESTS = json.loads((Path(__file__).parent / "requests.json").read_text())
GOES_ON = line_of(GOALS, "(defrule talk-root-goes-on")

SAMPLES = {"string": "x", "integer": 1, "boolean": True, "array": [], "object": {}}
WRONG = {
    "string": [3, True, [], {}],
    "integer": ["x", True, 1.5, [], {}],
    "boolean": ["true", 1, [], {}],
    "array": ["x", 3, True, {}],
    "object": ["x", 3, True, []],
}


def sample(shape):
    """A value of a type, with its required parts."""
    if "enum" in shape:
        return shape["enum"][0]
    made = SAMPLES.get(shape["type"], {})
    if shape["type"] == "object":
        return {name: sample(shape["parts"][name]) for name in shape.get("required", ())}
    return made


def wrong(shape, name) -> Iterator[tuple[str, object]]:
    """Values that are not of a type, and what an error has to name."""
    for value in WRONG.get(shape["type"], ()):
        yield name, value
    if "enum" in shape:
        yield name, "neither"
    for part in shape.get("required", ()):
        yield part, {each: value for each, value in sample(shape).items() if each != part}
    for part, inner in shape.get("parts", {}).items():
        for what, value in wrong(inner, part):
            yield what, {**sample(shape), part: value}
    for what, value in wrong(shape["items"], name) if "items" in shape else ():
        yield what, [value]


def struct_of(kind: Any) -> type[msgspec.Struct] | None:
    """The struct of an annotation, as that of a list's items."""
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        return kind
    return next(filter(None, map(struct_of, get_args(kind))), None)


def read_parts(shape: dict[str, Any], kind: Any) -> dict[str, Any]:
    """A type with those parts that the adapter reads: it ignores all others, whatever they hold."""
    struct, inner = struct_of(kind), shape.get("items", shape)
    if struct is None:
        return {"type": shape["type"]} if "parts" in inner else shape
    fields = {field.encode_name: field.type for field in msgspec.structs.fields(struct)}
    parts = {
        name: read_parts(part, fields[name])
        for name, part in inner.get("parts", {}).items()
        if name in fields
    }
    required = [name for name in inner.get("required", ()) if name in fields]
    reduced = {**inner, "parts": parts, "required": required}
    return {**shape, "items": reduced} if "items" in shape else reduced


ARGUMENTS = {command: kind for command, (kind, _, _) in Adapter(Wire(BytesIO(), BytesIO()))._handlers.items()}
for command, shape in REQUESTS.items():
    if struct_of(ARGUMENTS.get(command)) is not None:
        REQUESTS[command] = read_parts(shape, ARGUMENTS[command])

CASES = [
    (command, what, arguments)
    for command, shape in REQUESTS.items()
    for what, arguments in wrong({"type": "object"} if shape["type"] == "any" else shape, "")
]


def everywhere(client, phase):
    """Bring a session into a phase."""
    if phase == "new":
        return
    if phase == "ready":
        client.ask("initialize", adapterID="cxbridge")
        return
    client.launch(scenario="test-scenario", **({"clock": "real"} if phase == "running" else {}))
    if phase == "stopped":
        client.break_at(GOALS, GOES_ON)
    if phase != "launched":
        client.begin()
    if phase == "running":
        client.event("thread")
    elif phase == "stopped":
        client.stopped()
    elif phase == "over":
        client.event("terminated")


PHASES = ["new", "ready", "launched", "running", "stopped", "over"]


@pytest.mark.parametrize("phase", share(PHASES, 3))
def test_arguments_of_another_type_or_missing(client, phase):
    assert len(CASES) > 300
    everywhere(client, phase)
    answers = client.answers((command, arguments) for command, _, arguments in CASES)
    for (command, what, arguments), answer in zip(CASES, answers, strict=True):
        asked = f"{command} {json.dumps(arguments)}: {answer}"
        assert not answer["success"], asked
        assert "fault" not in answer["message"], asked
        if command == "launch" and phase != "ready":
            continue  # its arguments depend on the target: the phase comes first
        if "there is no request" not in answer["message"]:
            assert what in answer["message"], asked
    assert client.stderr == ""


RIGHT: dict[str, dict[str, Any]] = {
    "initialize": {"adapterID": "x"},
    "launch": {"scenario": "test-scenario"},
    "setBreakpoints": {"source": {"path": str(GOALS)}},
    "setFunctionBreakpoints": {"breakpoints": []},
    "setExceptionBreakpoints": {"filters": []},
}
AT_ANY_TIME = {"setBreakpoints", "setFunctionBreakpoints", "setExceptionBreakpoints"}
AFTER_LAUNCH = AT_ANY_TIME | {"threads", "terminate"}
ALLOWED = {
    "new": {"initialize"},
    "ready": AT_ANY_TIME | {"launch"},
    "launched": AFTER_LAUNCH | {"configurationDone"},
    "running": AFTER_LAUNCH | {"pause"},
    "stopped": AFTER_LAUNCH
    | {"stackTrace", "scopes", "variables", "setVariable", "evaluate", "stepInTargets"}
    # continuing ends the stop; see test_run.py
    | {"continue", "next", "stepIn", "stepOut"},
    "over": AFTER_LAUNCH,
}


@pytest.mark.parametrize("phase", PHASES)
def test_requests_in_a_phase_that_has_no_answer_to_them(client, phase):
    everywhere(client, phase)
    commands = [name for name in REQUESTS if name not in ALLOWED[phase] | {"disconnect"}]
    answers = client.answers((name, RIGHT.get(name, sample(REQUESTS[name]))) for name in commands)
    for command, answer in zip(commands, answers, strict=True):
        assert not answer["success"], answer
        assert answer["message"], command
        assert "fault" not in answer["message"], answer
        assert "are invalid" not in answer["message"], answer
    for command in sorted(ALLOWED[phase] & RIGHT.keys()):  # the rest is right
        client.ask(command, **RIGHT[command])


OF_THREADS = [name for name, shape in REQUESTS.items() if "threadId" in shape.get("parts", {})]


@pytest.mark.parametrize("number", [0, 10**20])
def test_unknown_threads(stopped, number):
    for command in OF_THREADS:
        answer = stopped.answer(command, **{**sample(REQUESTS[command]), "threadId": number})
        assert not answer["success"]
        assert any(why in answer["message"] for why in ("no thread", "no request", "is invalid")), answer


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
        ("variables", {"variablesReference": 0}, "no variables 0"),
        ("variables", {"variablesReference": 9999}, "no variables 9999"),
        ("setVariable", {"variablesReference": 9999, "name": "x", "value": "1"}, "no variables 9999"),
        ("stepIn", {"threadId": 1, "targetId": 99}, "no target 99"),
        ("setBreakpoints", {"source": {"path": "/nowhere/at/all"}}, "cannot read it"),
        ("setBreakpoints", {"source": {}}, "cannot read it"),
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
    assert (answer["success"], answer["message"]) == (False, "'stopOnEntry' must be true or false")


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
