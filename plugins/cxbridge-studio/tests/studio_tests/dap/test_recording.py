"""A recording that is debugged, forwards and backwards."""

from __future__ import annotations

import shutil

from studio_tests.dap.client import Client
from studio_tests.dap.conftest import GOALS, SCENARIO, line_of
from tests.forked import nursery
from tests.support import ROOT

GOES_ON = line_of(GOALS, "(defrule talk-root-goes-on")
MODIFY = line_of(GOALS, "(modify ?root")


def test_forwards_and_backwards(client, recording):
    known = client.launch(recording=str(recording))
    assert "supportsStepBack" not in known  # a run cannot
    assert any(
        each.get("event") == "capabilities" and each["body"]["capabilities"]["supportsStepBack"]
        for each in client.log
    )
    (at,) = client.break_at(GOALS, MODIFY)
    assert (at["verified"], at["line"]) == (True, GOES_ON)  # what happens in a rule is not recorded
    client.begin()
    assert client.stopped()["reason"] == "entry"
    modes, places = [], []
    for _ in range(3):
        stopped = client.go()
        assert stopped["hitBreakpointIds"] == [at["id"]]
        places.append(stopped["description"])
        modes.append(client.evaluate("?mode"))
    assert modes == ["FORMULATED", "SELECTED", "FINISHED"]
    assert client.go("reverseContinue")["description"] == places[1]
    assert client.evaluate("?root:mode") == "SELECTED"
    assert client.go("stepIn")["reason"] == "step"
    after = client.stack()[0]["name"]
    client.go("stepIn")
    client.break_at(GOALS)
    client.go("stepBack")
    assert client.stack()[0]["name"] == after
    assert client.go("stepBack")["description"] == places[1]
    assert client.evaluate("(goal (class TESTGOAL-PARENT) (mode ?m))") == "1 of 20 facts match"
    assert client.go("reverseContinue")["reason"] == "entry"


def test_the_same_variables_as_in_the_run(client, recording):
    client.launch(recording=str(recording))
    client.break_at(GOALS, GOES_ON)
    client.begin()
    client.stopped()
    client.go()
    recorded = client.below(client.scope("Variables"))
    stack = [(frame["name"], frame["line"]) for frame in client.stack()]
    with Client(ROOT) as live:
        live.launch(scenario="test-scenario")
        live.break_at(GOALS, GOES_ON)
        live.begin()
        live.stopped()
        assert [(frame["name"], frame["line"]) for frame in live.stack()] == stack
        running = live.below(live.scope("Variables"))
        assert {name: each["value"] for name, each in running.items()} == {
            name: each["value"] for name, each in recorded.items()
        }
        facts = live.below(live.scope("Facts"))
    early = ("path-info", "ff-feature-loaded")  # some exist before the recorder
    counts = {name: each["value"] for name, each in client.below(client.scope("Facts")).items()}
    assert len(counts) > 20
    for name, count in counts.items():
        assert name in early or facts[name]["value"] == count


def test_transitions_skills_and_loops(client, recording):
    client.launch(recording=str(recording))
    client.break_on("skill:say*:S_FINAL", "goal:TALK:FINISHED:COMPLETED")
    client.begin()
    client.stopped()
    first = client.go()
    assert "skill say{" in first["description"]
    transition = client.go("next")
    assert transition["reason"] in ("step", "function breakpoint")
    client.break_on()
    assert client.go("stepOut")["reason"] == "step"
    client.break_on("goal:TALK:FINISHED:COMPLETED", hitCondition=">=1")
    assert "TALK" in client.go("reverseContinue")["description"]
    # the goal's fact may follow its transition; its parents exist
    assert any("TESTGOAL-PARENT" in frame["name"] for frame in client.stack())


def test_nothing_can_be_changed(client, recording):
    client.launch(recording=str(recording))
    client.break_at(GOALS, GOES_ON)
    client.begin()
    client.stopped()
    client.go()
    root = client.below(client.scope("Variables"))["?root"]["variablesReference"]
    client.below(root)
    answer = client.answer("setVariable", variablesReference=root, name="mode", value="SELECTED")
    assert "this is a recording" in answer["message"]
    assert [scope["name"] for scope in client.ask("scopes", frameId=1)["scopes"]] == [
        "Variables",
        "Goals",
        "Facts",
    ]


def test_log_points_and_conditions(client, recording):
    client.launch(recording=str(recording))
    wanted = [
        {"line": GOES_ON, "logMessage": "the root is {?mode} {(nope)}"},
        {"line": GOES_ON, "condition": "(eq ?mode FINISHED)"},
        {"line": GOES_ON, "condition": "(nope)", "hitCondition": "3"},
    ]
    client.ask("setBreakpoints", source={"path": str(GOALS)}, breakpoints=wanted)
    client.begin()
    client.stopped()
    client.go()
    assert client.evaluate("?mode") == "FINISHED"
    said = [e["body"]["output"] for e in client.log if e.get("event") == "output"]
    assert sum("the root is SELECTED {(nope): CLIPS" in line for line in said) == 1
    assert "the condition fails" in client.go()["description"]


def test_its_end(client, recording):
    client.launch(recording=str(recording))
    client.begin()
    client.stopped()
    assert client.go()["description"].startswith("Stopped at the end of the recording")
    client.ask("stepBack", threadId=1)
    client.stopped()
    client.go()
    client.ask("continue", threadId=1)
    assert client.event("exited")["exitCode"] == 0
    client.event("terminated")
    client.ask("disconnect")
    assert client.wait() == 0


def test_the_files_as_they_were(client, tmp_path):
    folder = shutil.copytree(SCENARIO, tmp_path / "agent")
    file = tmp_path / "run.mcap"
    command = ["run", "-q", str(folder), "--trace", str(file), "--trace-level", "facts"]
    nursery().run(command).check_returncode()
    before = (folder / "talk-goals.clp").read_text()
    (folder / "talk-goals.clp").write_text("; all gone\n")
    client.launch(recording=str(file))
    client.break_on("rule:talk-begin")
    client.begin()
    client.stopped()
    client.go()
    source = client.stack()[0]["source"]
    assert "path" not in source
    assert client.ask("source", sourceReference=source["sourceReference"])["content"] == before
    found = client.ask("setBreakpoints", source=source, breakpoints=[{"line": GOES_ON}])["breakpoints"]
    assert found[0]["verified"]
    assert client.go()["hitBreakpointIds"] == [found[0]["id"]]


def test_without_rules_there_are_transitions(client, tmp_path):
    file = tmp_path / "run.mcap"
    nursery().run(["run", "-q", str(SCENARIO), "--trace", str(file)]).check_returncode()
    client.launch(recording=str(file))
    (at,) = client.break_at(GOALS, GOES_ON)
    assert (at["verified"], at["message"]) == (
        False,
        "no rules were recorded: record with --trace-level rules",
    )
    client.begin()
    first = client.stopped()["description"]
    assert client.go("stepIn")["description"] != first
    assert client.stack()[0]["name"].startswith("goal ")
    assert client.go("stepBack")["description"] == first
    client.go("stepOut")


def test_of_an_environment_that_is_not_there(client, recording):
    client.ask("initialize", adapterID="cxbridge")
    message = client.answer("launch", recording=str(recording), env="nobody")["message"]
    assert "of 'nobody'" in message
    assert "the environments are executive" in message
