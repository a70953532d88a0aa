"""Breakpoints, steps and edited facts over REST."""

from __future__ import annotations

import pytest

from tests.run.mini import AGENT, write_scenario
from web_tests.support import serving

pytest.importorskip("cxbridge_studio", reason="needs cxbridge-studio")

DEBUGGER = "/api/cxbridge/debugger"
MORE = """
(deftemplate battery (slot level (type INTEGER)) (multislot notes))
(deftemplate alarm (slot level))
(defrule mini-low (battery (level ?l&:(< ?l 10))) => (assert (alarm (level ?l))))
(defrule mini-heard (alarm (level ?l)) => (assert (heard ?l)))
"""


@pytest.fixture(name="client", scope="module")
def _client(tmp_path_factory):
    scenario = write_scenario(tmp_path_factory.mktemp("debugging") / "mini", agent=AGENT + MORE)
    with serving(config=scenario) as (_, client, _lines):
        client.until("/api/clips-executive/goals", lambda goals: not goals)
        yield client


@pytest.fixture(autouse=True)
def _clean(client):
    """Remove breakpoints and continue after each test."""
    yield
    assert client.ask("DELETE", f"{DEBUGGER}/breakpoints").json["breakpoints"] == []
    assert "stopped" not in client.ask("POST", f"{DEBUGGER}/go-on").json


def wait_for_stop(client):
    return client.until(DEBUGGER, lambda debugger: "stopped" in debugger)["stopped"]


def assert_battery(client, level):
    answer = client.ask("POST", "/api/cxbridge/facts", {"fact": f"(battery (level {level}))"})
    assert answer.status == 200
    return answer.json["index"]


def test_breakpoints_are_added_listed_and_removed(client):
    first = client.ask("POST", f"{DEBUGGER}/breakpoints", {"spec": "rule:mini-low if (> 1 2)"}).json
    second = client.ask("POST", f"{DEBUGGER}/breakpoints", {"spec": "goal:G:FINISHED"}).json
    assert first["kind"] == "Breakpoint"
    listed = client.get(DEBUGGER).json["breakpoints"]
    assert listed == [{"number": item["number"], "spec": item["spec"]} for item in (first, second)]
    assert client.ask("DELETE", f"{DEBUGGER}/breakpoints/{first['number']}").json["breakpoints"] == listed[1:]
    for number, status in ((first["number"], 404), ("x", 400), ("9" * 30, 400)):
        assert client.ask("DELETE", f"{DEBUGGER}/breakpoints/{number}").status == status
    answer = client.ask("POST", f"{DEBUGGER}/breakpoints", {"spec": "nonsense"})
    assert (answer.status, "use one of: rule:NAME" in answer.text) == (400, True)
    assert client.get(DEBUGGER).json["breakpoints"] == listed[1:]


def test_agent_stops_at_breakpoint_steps_and_continues(client):
    assert client.ask("POST", f"{DEBUGGER}/breakpoints", {"spec": "rule:mini-low"}).status == 200
    assert_battery(client, 1)
    stop = wait_for_stop(client)
    assert (stop["kind"], stop["next_rule"], stop["reason"]) == ("before", "mini-low", "before rule mini-low")
    assert client.get("/api/cxbridge/status").json["stopped"] == stop
    assert "stopped" not in client.ask("POST", f"{DEBUGGER}/step", {"what": "rule"}).json
    stop = wait_for_stop(client)
    assert (stop["kind"], stop["rule"], stop["next_rule"]) == ("step", "mini-low", "mini-heard")
    assert "stopped" not in client.ask("POST", f"{DEBUGGER}/go-on").json
    client.until("/api/clips/executive/facts?template=heard", lambda facts: len(facts) == 1)
    assert "stopped" not in client.get("/api/cxbridge/status").json
    assert client.ask("POST", f"{DEBUGGER}/step", {"what": "leap"}).status == 400


def test_fact_can_be_edited_at_breakpoint(client):
    assert client.ask("POST", f"{DEBUGGER}/breakpoints", {"spec": "rule:mini-low"}).status == 200
    index = assert_battery(client, 3)
    wait_for_stop(client)
    slots = {"level": "(+ 1 3)", "notes": '"a b" c'}
    edited = client.ask("PATCH", f"/api/cxbridge/facts/{index}", {"slots": slots}).json
    assert edited["kind"] == "FactIndex"
    results = client.get("/api/clips/executive/facts?template=battery&formatted=true").json[-1:]
    assert [(fact["index"], fact["formatted"]) for fact in results] == [
        (edited["index"], '(battery (level 4) (notes "a b" c))')
    ]
    for reference, body, status, message in (
        (index, {"slots": slots}, 404, "there is no fact"),
        ("x", {"slots": slots}, 400, "'index' must be a whole number"),
        (edited["index"], {"slots": {"lvel": "1"}}, 400, "has no slot 'lvel'"),
        (edited["index"], {"slots": {"level": "("}}, 400, "cannot evaluate"),
        (edited["index"], {"slots": {}}, 400, "no slot"),
        (edited["index"], {"slots": {"level": 4}}, 400, "'slots' must be"),
        (edited["index"], {"slots": {"level": "\0"}}, 400, "zero byte"),
        (edited["index"], {}, 400, "'slots' must be"),
    ):
        answer = client.ask("PATCH", f"/api/cxbridge/facts/{reference}", body)
        assert (answer.status, message in answer.text) == (status, True), answer.text
    assert client.ask("DELETE", f"/api/cxbridge/facts/{edited['index']}").status == 200


def test_interfaces_are_listed_with_values(client):
    results = client.get("/api/cxbridge/interfaces?type=Skiller*").json
    assert {data["type"] for data in results} == {"SkillerInterface", "SkillerDebugInterface"}
    (listed,) = client.get("/api/cxbridge/interfaces?type=SkillerInterface&id=Skiller").json
    single = client.get("/api/blackboard/interfaces/SkillerInterface/Skiller/data").json
    assert listed["data"].keys() == single["data"].keys()
    assert len(client.get("/api/cxbridge/interfaces").json) > len(results)
