"""The executive plug-in as of pull request 33, with services and with ticks in passes."""

from __future__ import annotations

import pytest

from cxbridge.mainloop import Hook
from cxbridge.run import run_scenario
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge_ros2cx.cx.node import CxNode

# The types of services and of clips_log. Their package marks the newer executive.
DEFINITIONS = {
    "package.xml": "<package><name>cx_msgs</name></package>",
    "srv/ClipsCommand.srv": "string env_name\nstring command\n---\nbool success\nstring message\n",
    "srv/SetTopicLogging.srv": "string env_name\nbool enabled\n---\nbool success\n",
    "msg/Log.msg": "string env_name\nstring logical_name\nstring line\n",
}
PARAMETERS = """
/**:
  ros__parameters:
    environments: ["one"]
    one: {plugins: ["executive", "files"], watch: ["facts"], MORE}
    executive: {plugin: "cx::ExecutivePlugin", publish_on_refresh: true}
    files: {plugin: "cx::FileLoadPlugin", load: ["AGENT"]}
"""
ENV, TRIGGER = "one", "std_srvs/srv/Trigger"


@pytest.fixture
def log_messages():
    """Return a list for the messages on clips_log, as logical name and line."""
    return []


@pytest.fixture
def run(tmp_path, log_messages):
    """Return a function that runs an agent and calls a service of the executive plug-in in each loop."""

    for name, text in DEFINITIONS.items():
        file = tmp_path / "workspace" / "cx_msgs" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def run(program, calls=(), settings="rule_limit: -1"):
        (tmp_path / "agent.clp").write_text(program)
        file = tmp_path / "params.yaml"
        file.write_text(PARAMETERS.replace("AGENT", str(tmp_path / "agent.clp")).replace("MORE", settings))
        remaining_calls, answers, firings = [*calls], [], []

        def attach(assembly):
            assert isinstance(assembly.executive, CxNode)
            node = assembly.executive.manager.context.ros.graph.join("peer")
            topic = "/clips_manager/executive/refresh_agenda"
            node.subscribe(topic, "std_msgs/msg/Int64", lambda message: firings.append(message["data"]))

            def record_log(message):
                log_messages.append((message["logical_name"], message["line"]))

            node.subscribe("/clips_manager/clips_log", "cx_msgs/msg/Log", record_log)

            def step():
                if remaining_calls:
                    name, *command = remaining_calls.pop(0)
                    kind = "cx_msgs/srv/ClipsCommand" if command else TRIGGER
                    request = dict(zip(("env_name", "command"), command, strict=True)) if command else {}
                    client = node.create_client(f"/clips_manager/executive/{name}", kind)
                    client.call(
                        request, lambda answer: answers.append((answer["success"], answer["message"]))
                    )

            assembly.loop.add(Hook.PRE_LOOP, step)

        options = options_from_keywords(
            file, ros2cx=tmp_path / "workspace", timeout=2.0, log_dir=tmp_path / "logs"
        )
        result = run_scenario(options, attach=attach)
        lines = [line.split("[info] ")[1] for line in (tmp_path / "logs/one.log").read_text().splitlines()]
        return result, lines, answers, firings

    return run


TICK_RULE = "(defrule tick (time ?) => (printout t tick crlf))"


def test_services_answer_like_recording(run):
    _, lines, answers, firings = run(
        TICK_RULE,
        [
            *(("pause",), ("pause",), ("tick_once",)),
            ("build", ENV, "(deftemplate example (slot message (type STRING)))"),
            ("build", ENV, "(deftemplate (slot message))"),
            ("build", ENV, "(defxyz a)"),
            ("eval", ENV, '(assert (example (message "hello")))'),
            ("eval", "", "(printout info (+ 1 2) crlf)"),
            ("eval", ENV, "(assert ("),
            ("eval", ENV, "(nth$ 1 5)"),
            ("eval", "nonexistent_env", "(facts)"),
            *(("resume",), ("resume",)),
        ],
    )
    assert answers == [
        (True, "executive paused."),
        (False, "executive already paused."),
        (True, "Tick executed."),
        (True, ""),
        (False, "Build failed: syntax error while parsing the construct."),
        (False, "Build failed: construct name not recognized."),
        (True, ""),
        (True, ""),
        (False, "Eval failed: syntax error while parsing the expression."),
        (False, "Eval failed: syntax error while parsing the expression."),
        (False, "Environment 'nonexistent_env' not found."),
        (True, "executive resumed."),
        (False, "executive already running."),
    ]
    assert any(line.endswith('(example (message "hello"))') for line in lines)
    assert "3" in lines
    assert lines.count("tick") == sum(firings) < 15


def test_time_fact_exists_only_in_first_pass(run):
    program = "(defrule a (time ?) => (assert (b))) (defrule c ?b <- (b) (not (time ?)) => (retract ?b))"
    result, _, _, firings = run(program)
    assert set(firings) == {2}
    assert result.status == 0


def test_log_lines_are_published(run, log_messages):
    program = '(defrule hello (time ?) (not (said)) => (assert (said)) (printout green "hello" crlf))'
    run(program, settings="log_clips_to_topic: true")
    assert ("green", "hello") in log_messages
    assert any(name == "stdout" and line.endswith("(said)") for name, line in log_messages)


def test_modules_of_focus_stack_are_run(run):
    program = (
        "(defmodule MAIN (export ?ALL)) (defmodule DOOR (import MAIN ?ALL))"
        " (defrule DOOR::open => (printout t open crlf))"
    )
    result, lines, _, _ = run(program, settings='focus_stack: ["MAIN", "DOOR", "WINDOW"]')
    assert lines.count("open") == 1
    assert result.reason.endswith("Focus stack entry 'WINDOW' is not a valid module, removing from stack.")


def test_rule_limit_ends_tick(run):
    program = "(deffacts f (n 0)) (defrule on (time ?) ?f <- (n ?x) => (retract ?f) (assert (n (+ ?x 1))))"
    result, _, _, firings = run(program, settings="rule_limit: 5, focus_stack: []")
    assert set(firings) == {5}
    assert "Rule fire limit of 5 was reached." in result.reason
