"""A debugged run, with our own client."""

from __future__ import annotations

import re
import shutil

import pytest

from cxbridge.events import GoalTransition, PlanActionTransition
from cxbridge.trace.formats.registry import open_run
from studio_tests.dap.conftest import GOALS, SCENARIO, line_of
from tests.forked import nursery
from tests.support import needs_plugin

GOES_ON = line_of(GOALS, "(defrule talk-root-goes-on")
BIND = line_of(GOALS, "(bind ?modes")
MODIFY = line_of(GOALS, "(modify ?root")


def test_a_breakpoint_in_a_rule(client):
    known = client.launch(scenario="test-scenario")
    assert known["supportsLogPoints"]
    moved, at, past = client.break_at(GOALS, GOES_ON - 1, GOES_ON, 400)
    assert (moved["verified"], moved["line"]) == (True, GOES_ON)
    assert at["line"] == GOES_ON
    assert (past["verified"], past["message"]) == (False, "no rule begins at this line or below")
    client.begin()
    stopped = client.stopped()
    assert (stopped["reason"], stopped["description"]) == (
        "breakpoint",
        "Stopped before rule talk-root-goes-on",
    )
    assert stopped["hitBreakpointIds"] == [moved["id"]]
    rule, goal = client.stack()
    assert (rule["name"], rule["line"], rule["source"]["path"]) == (
        "talk-root-goes-on",
        GOES_ON,
        str(GOALS),
    )
    assert re.fullmatch(r"goal RUN-ONE-TESTGOAL-PARENT-gen\d+ \(TESTGOAL-PARENT\): FORMULATED", goal["name"])
    variables = client.below(client.scope("Variables"))
    assert (variables["?mode"]["value"], variables["?mode"]["type"]) == ("FORMULATED", "SYMBOL")
    slots = client.below(variables["?root"]["variablesReference"])
    assert slots["class"]["value"] == "TESTGOAL-PARENT"
    agenda = client.below(client.scope("Agenda"))
    assert "talk-root-goes-on: f-" in agenda["1"]["value"]


def test_a_breakpoint_in_a_right_hand_side(client):
    stopped = client.stop_at(GOALS, MODIFY)
    assert stopped["description"] == f"Stopped at line {MODIFY} of rule talk-root-goes-on"
    assert client.stack()[0]["line"] == MODIFY
    variables = client.below(client.scope("Variables"))
    assert variables["?modes"]["value"] == "(FORMULATED SELECTED EXPANDED FINISHED EVALUATED RETRACTED)"
    assert client.evaluate("(nth$ (+ 1 (member$ ?mode ?modes)) ?modes)") == "SELECTED"
    # the right-hand side has begun: its activation is gone, its goal is unchanged
    assert all("goes-on" not in item["value"] for item in client.below(client.scope("Agenda")).values())
    assert client.evaluate("?root:mode") == "FORMULATED"
    client.break_at(GOALS)
    assert client.go("stepIn")["reason"] == "step"  # to the end of the rule
    assert client.evaluate("(goal (class TESTGOAL-PARENT) (mode SELECTED))") == "1 of 20 facts match"


def test_step_by_actions(client):
    client.stop_at(GOALS, BIND)
    targets = client.ask("stepInTargets", frameId=1)["targets"]
    assert [each["label"] for each in targets] == ["the next rule", "the next action of a right-hand side"]
    client.ask("stepIn", threadId=1, targetId=targets[1]["id"])
    assert client.stopped()["description"] == f"Stopped at line {MODIFY} of rule talk-root-goes-on"


def test_steps(client):
    client.launch(scenario="test-scenario", stopOnEntry=True)
    client.break_at(GOALS, GOES_ON)
    client.begin()
    assert client.stopped()["reason"] == "entry"
    first = client.stack()[0]["name"]
    assert client.go("stepIn")["description"] == f"Stopped after rule {first}"
    client.go()
    client.break_at(GOALS)
    following = client.go("next")
    assert following["reason"] == "step"
    assert following["description"].startswith("Stopped at goal ")
    assert client.go("stepOut")["description"] == "Stopped at the end of the loop"


def test_breakpoints_on_goals_actions_and_skills(client):
    client.launch(scenario="test-scenario")
    made = client.break_on("goal:TALK:FINISHED", "action:say-hello:RUNNING", "skill:say*:S_FINAL", "TALK")
    assert [each["verified"] for each in made] == [True, True, True, False]
    assert "'TALK' is not a breakpoint" in made[3]["message"]
    client.begin()
    assert "action say-hello" in client.stopped()["description"]
    frames = [frame["name"] for frame in client.stack()]
    assert frames[1].startswith("action say-hello")
    assert frames[2].endswith("(TALK): DISPATCHED")
    assert frames[-1].endswith("(TESTGOAL-PARENT): DISPATCHED")
    slots = client.below(client.scope("Slots", 2))
    assert slots["action-name"]["value"] == "say-hello"
    plan = client.below(client.scope("Plan", 3))
    assert next(item["value"] for item in plan.values()) == "RUNNING"
    assert "skill say{" in client.go()["description"]
    at_goal = client.go()
    while made[0]["id"] not in at_goal["hitBreakpointIds"]:
        at_goal = client.go()
    assert at_goal["reason"] == "function breakpoint"
    # the match of the rule is still known, though it has modified the goal
    variables = client.below(client.scope("Variables"))
    assert "(mode DISPATCHED)" in variables["?g"]["value"]


def test_conditions_hits_and_log_points(client):
    client.launch(scenario="test-scenario")
    broken = {"line": GOES_ON, "hitCondition": "often"}
    third = {"line": GOES_ON, "hitCondition": "3"}
    selected = {"line": MODIFY, "condition": "(eq ?mode SELECTED)"}
    spoken = {"line": BIND, "logMessage": "the root {?root:id} is {?mode}, {(+ 1 1)} {(nope)}"}
    found = client.ask(
        "setBreakpoints", source={"path": str(GOALS)}, breakpoints=[broken, third, selected, spoken]
    )["breakpoints"]
    assert [each["verified"] for each in found] == [False, True, True, True]
    assert "'often' is not a hit count" in found[0]["message"]
    client.begin()
    first = client.stopped()
    assert (first["hitBreakpointIds"], first["description"]) == (
        [found[2]["id"]],
        f"Stopped at line {MODIFY} of rule talk-root-goes-on",
    )
    assert client.evaluate("?mode") == "SELECTED"
    said = [event["body"]["output"] for event in client.log if event.get("event") == "output"]
    spoken_lines = [line for line in said if "the root" in line]
    assert len(spoken_lines) == 2
    assert "is FORMULATED, 2 {(nope): CLIPS cannot evaluate" in spoken_lines[0]
    assert client.go()["hitBreakpointIds"] == [found[1]["id"]]
    assert client.evaluate("?mode") == "FINISHED"


def test_kinds_of_failures(client):
    known = client.launch(scenario="test-scenario")
    names = [each["filter"] for each in known["exceptionBreakpointFilters"]]
    assert not client.answer("setExceptionBreakpoints", filters=["nothing"])["success"]
    client.ask("setExceptionBreakpoints", filters=names)
    client.begin()
    stopped = client.stopped()
    assert stopped["reason"] == "exception"
    assert "FAILED" in stopped["text"]


def test_set_a_slot(client):
    client.stop_at(GOALS, GOES_ON)
    goals = client.below(client.scope("Goals"))
    (root,) = goals.values()
    reference = root["variablesReference"]
    slots = client.below(reference)
    assert "presentationHint" not in slots["message"]
    done = client.ask("setVariable", variablesReference=reference, name="message", value='"hello there"')
    assert done["value"] == '"hello there"'
    assert client.below(reference)["message"]["value"] == '"hello there"'
    # again: the fact has another index now
    client.ask("setVariable", variablesReference=reference, name="message", value='"again"')
    assert client.evaluate('(goal (message "again"))') == "1 of 20 facts match"
    for name, value, why in (
        ("mode", "(", "CLIPS cannot evaluate"),
        ("nothing", "3", "nothing cannot be changed"),
        ("mode", "a b", "mode"),
    ):
        answer = client.answer("setVariable", variablesReference=reference, name=name, value=value)
        assert not answer["success"]
        assert why in answer["message"]


def test_evaluate(client):
    client.stop_at(GOALS, GOES_ON)
    assert client.evaluate("(+ 1 2)") == "3"
    assert client.evaluate("?mode", "hover") == "FORMULATED"
    assert client.evaluate("?nobody").startswith("there is no variable ?nobody here")
    assert client.evaluate('(str-cat ?mode "-x")') == '"FORMULATED-x"'
    assert client.evaluate("(goal (class ?c&TALK|ALWAYS-FAIL))") == "3 of 20 facts match"
    assert client.evaluate("(time $?)") == "1 of 1 facts match"  # a function has this name, too
    assert "Missing function declaration for 'nope'" in client.evaluate("(nope)")
    assert "printout" not in client.evaluate('(printout t "hello" crlf)')
    assert client.event("output", lambda body: "hello" in body["output"])["category"] == "console"
    assert client.evaluate("(assert (made 1))").startswith("<Fact-")
    answer = client.ask("evaluate", expression="(made ?)", frameId=1)
    (made,) = client.below(answer["variablesReference"]).values()
    assert made["value"] == "(made 1)"
    client.break_at(GOALS)
    client.ask("continue", threadId=1)
    assert "is invalid now" in client.evaluate("?mode")


def test_pause_and_end(client):
    client.launch(scenario="test-scenario", clock="real")
    client.begin()
    client.event("output", lambda body: "Hello" in body["output"] or "say" in body["output"])
    client.ask("pause", threadId=1)
    assert client.stopped()["reason"] == "pause"
    client.ask("terminate")
    assert client.event("exited")["exitCode"] == 130
    client.event("terminated")
    client.ask("disconnect")
    assert client.wait() == 0


def test_disconnect_ends_rules_that_do_not_end(client, tmp_path):
    folder = shutil.copytree(SCENARIO, tmp_path / "agent")
    world = folder / "talk-world.clp"
    endless = '(defrule endless (domain-loaded) => (printout t "spinning" crlf) (while TRUE do (bind ?x 1)))'
    world.write_text(f"{world.read_text()}\n{endless}\n")
    client.launch(scenario=str(folder))
    client.begin()
    client.event("output", lambda body: "spinning" in body["output"])
    client.ask("disconnect")
    assert client.wait() == 0


def test_a_client_that_goes_without_a_word(client):
    client.launch(scenario="test-scenario", stopOnEntry=True)
    client.begin()
    client.stopped()
    assert client.end() == 0
    assert client.stderr == ""


def test_no_message_of_the_protocol(client):
    client.send_bytes(b"GET / HTTP/1.1\r\n\r\n")
    assert client.wait() == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "no scenario given"),
        ({"scenario": "nowhere"}, "nowhere"),
        ({"scenario": "test-scenario", "skilldirs": []}, "a run has no option 'skilldirs'"),
        ({"scenario": "test-scenario", "recording": "x.mcap"}, "a run has no option 'recording'"),
        ({"scenario": "test-scenario", "replay": "x.mcap"}, "a replay cannot be debugged"),
        ({"scenario": 3}, "scenario"),
        ({"scenario": "test-scenario", "timeout": "long"}, "timeout"),
        ({"scenario": "test-scenario", "cwd": "/nowhere/at/all"}, "'cwd' cannot be"),
    ],
)
def test_a_launch_that_makes_no_sense(client, arguments, message):
    client.ask("initialize", adapterID="cxbridge")
    answer = client.answer("launch", **arguments)
    if answer["success"]:  # mistakes show when it begins
        client.begin()
        told = client.event("output", lambda body: body["category"] == "stderr")["output"]
        assert client.event("exited")["exitCode"] == 2
    else:
        told = answer["message"]
    assert message in told
    assert "fault" not in told


def test_a_rule_that_was_not_loaded(client, tmp_path):
    other = tmp_path / "other.clp"
    other.write_text("(defrule of-nobody (a) => (assert (b)))\n(defrule talk-begin (a) => )\n")
    client.launch(scenario="test-scenario")
    made = client.break_at(other, 1, 2)
    client.break_at(GOALS, GOES_ON)
    assert all(each["verified"] for each in made)  # not known yet
    client.begin()
    changes = [client.event("breakpoint")["breakpoint"] for _ in made]
    assert [(each["id"], each["verified"]) for each in changes] == [(each["id"], False) for each in made]
    assert changes[0]["message"] == "the spec does not load other.clp"
    assert "the loaded rule talk-begin is defined in" in changes[1]["message"]


def test_without_debugging(client):
    client.ask("initialize", adapterID="cxbridge")
    client.ask("launch", scenario="test-scenario", noDebug=True, stopOnEntry=True)
    client.break_at(GOALS, GOES_ON)
    client.begin()
    assert client.event("exited")["exitCode"] == 0
    assert not any(each.get("event") == "stopped" for each in client.log)


@needs_plugin("robot-memory")
def test_several_agents_are_threads(client):
    client.launch(scenario="two-agents")
    client.break_on("goal:*:FORMULATED")
    client.begin()
    stopped = client.stopped()
    threads = client.ask("threads")["threads"]
    assert len(threads) == 2
    assert client.ask("stackTrace", threadId=stopped["threadId"])["stackFrames"]
    other = next(each["id"] for each in threads if each["id"] != stopped["threadId"])
    assert client.ask("stackTrace", threadId=other)["stackFrames"] == []
    client.break_on()
    client.go("next")
    client.ask("continue", threadId=1)  # ends the step of the other agent, too
    assert client.event_of("stopped", "exited")["event"] == "exited"


def transitions(file):
    return [
        (type(event).__name__, event.time_us, str(event))
        for event in open_run(file)
        if isinstance(event, GoalTransition | PlanActionTransition)
    ]


def test_a_debugged_run_decides_the_same(client, tmp_path):
    plain, debugged = tmp_path / "plain.mcap", tmp_path / "debugged.mcap"
    nursery().run(["run", "-q", str(SCENARIO), "--trace", str(plain)]).check_returncode()
    client.launch(scenario=str(SCENARIO), trace=str(debugged))
    client.break_at(GOALS, GOES_ON, MODIFY)
    client.break_on("goal:*:FINISHED")
    client.begin()
    stops = 0
    while (event := client.event_of("stopped", "exited"))["event"] == "stopped":
        stops += 1
        client.evaluate("?mode")
        client.ask("continue", threadId=1)
    assert stops > 15
    assert event["body"]["exitCode"] == 0
    assert transitions(debugged) == transitions(plain)
