"""Debugged runs with the minimal client."""

from __future__ import annotations

import re
import shutil

import pytest

from cxbridge.events import GoalTransition, PlanActionTransition
from cxbridge.trace.formats.registry import open_run
from studio_tests.dap.conftest import GOALS, SCENARIO, find_line
from tests.forked import nursery
from tests.support import needs_plugin

ROOT_RULE_LINE = find_line(GOALS, "(defrule talk-root-goes-on")
BIND_LINE = find_line(GOALS, "(bind ?modes")
MODIFY_LINE = find_line(GOALS, "(modify ?root")


def test_breakpoint_at_rule_stops_before_rule(client):
    capabilities = client.launch(scenario="test-scenario")
    assert capabilities["supportsLogPoints"]
    moved, at, past = client.set_line_breakpoints(GOALS, ROOT_RULE_LINE - 1, ROOT_RULE_LINE, 400)
    assert (moved["verified"], moved["line"]) == (True, ROOT_RULE_LINE)
    assert at["line"] == ROOT_RULE_LINE
    assert (past["verified"], past["message"]) == (False, "no rule begins at this line or below")
    client.start_run()
    stopped = client.wait_for_stop()
    assert (stopped["reason"], stopped["description"]) == (
        "breakpoint",
        "Stopped before rule talk-root-goes-on",
    )
    assert stopped["hitBreakpointIds"] == [moved["id"]]
    rule, goal = client.get_stack()
    assert (rule["name"], rule["line"], rule["source"]["path"]) == (
        "talk-root-goes-on",
        ROOT_RULE_LINE,
        str(GOALS),
    )
    assert re.fullmatch(r"goal RUN-ONE-TESTGOAL-PARENT-gen\d+ \(TESTGOAL-PARENT\): FORMULATED", goal["name"])
    variables = client.get_variables(client.get_scope("Variables"))
    assert (variables["?mode"]["value"], variables["?mode"]["type"]) == ("FORMULATED", "SYMBOL")
    slots = client.get_variables(variables["?root"]["variablesReference"])
    assert slots["class"]["value"] == "TESTGOAL-PARENT"
    agenda = client.get_variables(client.get_scope("Agenda"))
    assert "talk-root-goes-on: f-" in agenda["1"]["value"]


def test_breakpoint_in_right_hand_side_stops_at_action(client):
    stopped = client.launch_to_line(GOALS, MODIFY_LINE)
    assert stopped["description"] == f"Stopped at line {MODIFY_LINE} of rule talk-root-goes-on"
    assert client.get_stack()[0]["line"] == MODIFY_LINE
    variables = client.get_variables(client.get_scope("Variables"))
    assert variables["?modes"]["value"] == "(FORMULATED SELECTED EXPANDED FINISHED EVALUATED RETRACTED)"
    assert client.evaluate("(nth$ (+ 1 (member$ ?mode ?modes)) ?modes)") == "SELECTED"
    # during the right-hand side the activation is gone, and the goal is unchanged
    assert all(
        "goes-on" not in item["value"] for item in client.get_variables(client.get_scope("Agenda")).values()
    )
    assert client.evaluate("?root:mode") == "FORMULATED"
    client.set_line_breakpoints(GOALS)
    assert client.resume("stepIn")["reason"] == "step"  # to the end of the rule
    assert client.evaluate("(goal (class TESTGOAL-PARENT) (mode SELECTED))") == "1 of 20 facts match"


def test_step_in_target_steps_by_actions(client):
    client.launch_to_line(GOALS, BIND_LINE)
    targets = client.request("stepInTargets", frameId=1)["targets"]
    assert [row["label"] for row in targets] == ["the next rule", "the next action of a right-hand side"]
    client.request("stepIn", threadId=1, targetId=targets[1]["id"])
    assert client.wait_for_stop()["description"] == f"Stopped at line {MODIFY_LINE} of rule talk-root-goes-on"


def test_steps_stop_after_rule_transition_and_loop(client):
    client.launch(scenario="test-scenario", stopOnEntry=True)
    client.set_line_breakpoints(GOALS, ROOT_RULE_LINE)
    client.start_run()
    assert client.wait_for_stop()["reason"] == "entry"
    first = client.get_stack()[0]["name"]
    assert client.resume("stepIn")["description"] == f"Stopped after rule {first}"
    client.resume()
    client.set_line_breakpoints(GOALS)
    following = client.resume("next")
    # the stack begins with the rule that has caused the transition, not with the next rule
    assert (following["reason"], client.get_stack()[0]["name"]) == ("step", "talk-root-goes-on")
    assert following["description"].startswith("Stopped at goal ")
    assert client.resume("stepOut")["description"] == "Stopped at the end of the loop"


def test_named_breakpoints_stop_at_goals_actions_and_skills(client):
    client.launch(scenario="test-scenario")
    breakpoints = client.set_named_breakpoints(
        "goal:TALK:FINISHED", "action:say-hello:RUNNING", "skill:say*:S_FINAL", "TALK"
    )
    assert [row["verified"] for row in breakpoints] == [True, True, True, False]
    assert "'TALK' is not a breakpoint" in breakpoints[3]["message"]
    client.start_run()
    assert "action say-hello" in client.wait_for_stop()["description"]
    frames = [frame["name"] for frame in client.get_stack()]
    assert frames[1].startswith("action say-hello")
    assert frames[2].endswith("(TALK): DISPATCHED")
    assert frames[-1].endswith("(TESTGOAL-PARENT): DISPATCHED")
    slots = client.get_variables(client.get_scope("Slots", 2))
    assert slots["action-name"]["value"] == "say-hello"
    plan = client.get_variables(client.get_scope("Plan", 3))
    assert next(item["value"] for item in plan.values()) == "RUNNING"
    assert "skill say{" in client.resume()["description"]
    at_goal = client.resume()
    while breakpoints[0]["id"] not in at_goal["hitBreakpointIds"]:
        at_goal = client.resume()
    assert at_goal["reason"] == "function breakpoint"
    # the variables have the values before the rule modified the goal
    variables = client.get_variables(client.get_scope("Variables"))
    assert "(mode DISPATCHED)" in variables["?goal-fact"]["value"]


def test_line_breakpoints_have_conditions_counts_and_logs(client):
    client.launch(scenario="test-scenario")
    invalid = {"line": ROOT_RULE_LINE, "hitCondition": "often"}
    third = {"line": ROOT_RULE_LINE, "hitCondition": "3"}
    selected = {"line": MODIFY_LINE, "condition": "(eq ?mode SELECTED)"}
    logged = {"line": BIND_LINE, "logMessage": "the root {?root:id} is {?mode}, {(+ 1 1)} {(nope)}"}
    breakpoints = client.request(
        "setBreakpoints", source={"path": str(GOALS)}, breakpoints=[invalid, third, selected, logged]
    )["breakpoints"]
    assert [row["verified"] for row in breakpoints] == [False, True, True, True]
    assert "'often' is not a hit count" in breakpoints[0]["message"]
    client.start_run()
    first = client.wait_for_stop()
    assert (first["hitBreakpointIds"], first["description"]) == (
        [breakpoints[2]["id"]],
        f"Stopped at line {MODIFY_LINE} of rule talk-root-goes-on",
    )
    assert client.evaluate("?mode") == "SELECTED"
    outputs = [event["body"]["output"] for event in client.log if event.get("event") == "output"]
    logged_lines = [line for line in outputs if "the root" in line]
    assert len(logged_lines) == 2
    assert "is FORMULATED, 2 {(nope): CLIPS cannot evaluate" in logged_lines[0]
    assert client.resume()["hitBreakpointIds"] == [breakpoints[1]["id"]]
    assert client.evaluate("?mode") == "FINISHED"


def test_exception_filters_stop_at_failure(client):
    capabilities = client.launch(scenario="test-scenario")
    names = [row["filter"] for row in capabilities["exceptionBreakpointFilters"]]
    assert not client.get_response("setExceptionBreakpoints", filters=["nothing"])["success"]
    client.request("setExceptionBreakpoints", filters=names)
    client.start_run()
    stopped = client.wait_for_stop()
    assert stopped["reason"] == "exception"
    assert "FAILED" in stopped["text"]


def test_set_variable_changes_slot(client):
    client.launch_to_line(GOALS, ROOT_RULE_LINE)
    goals = client.get_variables(client.get_scope("Goals"))
    (root,) = goals.values()
    reference = root["variablesReference"]
    slots = client.get_variables(reference)
    assert "presentationHint" not in slots["message"]
    response = client.request(
        "setVariable", variablesReference=reference, name="message", value='"hello there"'
    )
    assert response["value"] == '"hello there"'
    assert client.get_variables(reference)["message"]["value"] == '"hello there"'
    # the fact has a new index after the change
    client.request("setVariable", variablesReference=reference, name="message", value='"again"')
    assert client.evaluate('(goal (message "again"))') == "1 of 20 facts match"
    for name, value, reason in (
        ("mode", "(", "CLIPS cannot evaluate"),
        ("nothing", "3", "nothing cannot be changed"),
        ("mode", "a b", "mode"),
    ):
        response = client.get_response("setVariable", variablesReference=reference, name=name, value=value)
        assert not response["success"]
        assert reason in response["message"]


def test_evaluate_values_patterns_and_output(client):
    client.launch_to_line(GOALS, ROOT_RULE_LINE)
    assert client.evaluate("(+ 1 2)") == "3"
    assert client.evaluate("?mode", "hover") == "FORMULATED"
    assert client.evaluate("?missing").startswith("there is no variable ?missing here")
    assert client.evaluate('(str-cat ?mode "-x")') == '"FORMULATED-x"'
    assert client.evaluate("(goal (class ?c&TALK|ALWAYS-FAIL))") == "3 of 20 facts match"
    assert client.evaluate("(time $?)") == "1 of 1 facts match"  # a pattern, although a function has the name
    assert "Missing function declaration for 'nope'" in client.evaluate("(nope)")
    assert "printout" not in client.evaluate('(printout t "hello" crlf)')
    assert client.wait_for_event("output", lambda body: "hello" in body["output"])["category"] == "console"
    assert client.evaluate("(assert (made 1))").startswith("<Fact-")
    response = client.request("evaluate", expression="(made ?)", frameId=1)
    (fact,) = client.get_variables(response["variablesReference"]).values()
    assert fact["value"] == "(made 1)"
    client.set_line_breakpoints(GOALS)
    client.request("continue", threadId=1)
    assert "is invalid now" in client.evaluate("?mode")


def test_run_pauses_and_terminates(client):
    client.launch(scenario="test-scenario", clock="real")
    client.start_run()
    client.wait_for_event("output", lambda body: "Hello" in body["output"] or "say" in body["output"])
    client.request("pause", threadId=1)
    assert client.wait_for_stop()["reason"] == "pause"
    client.request("terminate")
    assert client.wait_for_event("exited")["exitCode"] == 130
    client.wait_for_event("terminated")
    client.request("disconnect")
    assert client.wait() == 0


def test_disconnect_ends_endless_rule(client, tmp_path):
    folder = shutil.copytree(SCENARIO, tmp_path / "agent")
    world = folder / "talk-world.clp"
    endless = '(defrule endless (domain-loaded) => (printout t "spinning" crlf) (while TRUE do (bind ?x 1)))'
    world.write_text(f"{world.read_text()}\n{endless}\n")
    client.launch(scenario=str(folder))
    client.start_run()
    client.wait_for_event("output", lambda body: "spinning" in body["output"])
    client.request("disconnect")
    assert client.wait() == 0


def test_adapter_ends_at_end_of_input(client):
    client.launch(scenario="test-scenario", stopOnEntry=True)
    client.start_run()
    client.wait_for_stop()
    assert client.end() == 0
    assert client.stderr == ""


def test_invalid_header_ends_adapter(client):
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
def test_invalid_launch_is_an_error(client, arguments, message):
    client.request("initialize", adapterID="cxbridge")
    response = client.get_response("launch", **arguments)
    if response["success"]:  # the start of the run reports the mistake
        client.start_run()
        error = client.wait_for_event("output", lambda body: body["category"] == "stderr")["output"]
        assert client.wait_for_event("exited")["exitCode"] == 2
    else:
        error = response["message"]
    assert message in error
    assert "fault" not in error


def test_breakpoint_at_rule_without_load_becomes_unverified(client, tmp_path):
    other_file = tmp_path / "other.clp"
    other_file.write_text("(defrule not-loaded (a) => (assert (b)))\n(defrule talk-begin (a) => )\n")
    client.launch(scenario="test-scenario")
    breakpoints = client.set_line_breakpoints(other_file, 1, 2)
    client.set_line_breakpoints(GOALS, ROOT_RULE_LINE)
    assert all(row["verified"] for row in breakpoints)  # the loaded rules are unknown before the start
    client.start_run()
    changes = [client.wait_for_event("breakpoint")["breakpoint"] for _ in breakpoints]
    assert [(row["id"], row["verified"]) for row in changes] == [(row["id"], False) for row in breakpoints]
    assert changes[0]["message"] == "the spec does not load other.clp"
    assert "the loaded rule talk-begin is defined in" in changes[1]["message"]


def test_no_debug_launch_ignores_breakpoints(client):
    client.request("initialize", adapterID="cxbridge")
    client.request("launch", scenario="test-scenario", noDebug=True, stopOnEntry=True)
    client.set_line_breakpoints(GOALS, ROOT_RULE_LINE)
    client.start_run()
    assert client.wait_for_event("exited")["exitCode"] == 0
    assert not any(row.get("event") == "stopped" for row in client.log)


@needs_plugin("robot-memory")
def test_agents_are_threads(client):
    client.launch(scenario="two-agents")
    client.set_named_breakpoints("goal:*:FORMULATED")
    client.start_run()
    stopped = client.wait_for_stop()
    threads = client.request("threads")["threads"]
    assert len(threads) == 2
    assert client.request("stackTrace", threadId=stopped["threadId"])["stackFrames"]
    other_thread = next(row["id"] for row in threads if row["id"] != stopped["threadId"])
    assert client.request("stackTrace", threadId=other_thread)["stackFrames"] == []
    client.set_named_breakpoints()
    client.resume("next")
    client.request("continue", threadId=1)  # also ends the step of the second agent
    assert client.wait_for_events("stopped", "exited")["event"] == "exited"


def read_transitions(file):
    return [
        (type(event).__name__, event.time_us, str(event))
        for event in open_run(file)
        if isinstance(event, GoalTransition | PlanActionTransition)
    ]


def test_debugged_run_has_transitions_of_plain_run(client, tmp_path):
    plain, debugged = tmp_path / "plain.mcap", tmp_path / "debugged.mcap"
    nursery().run(["run", "-q", str(SCENARIO), "--trace", str(plain)]).check_returncode()
    client.launch(scenario=str(SCENARIO), trace=str(debugged))
    client.set_line_breakpoints(GOALS, ROOT_RULE_LINE, MODIFY_LINE)
    client.set_named_breakpoints("goal:*:FINISHED")
    client.start_run()
    stops = 0
    while (event := client.wait_for_events("stopped", "exited"))["event"] == "stopped":
        stops += 1
        client.evaluate("?mode")
        client.request("continue", threadId=1)
    assert stops > 15
    assert event["body"]["exitCode"] == 0
    assert read_transitions(debugged) == read_transitions(plain)
