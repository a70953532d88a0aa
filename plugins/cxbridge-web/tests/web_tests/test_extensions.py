"""The REST API beyond Fawkes: rules, why, facts, messages, the page, the description."""

from __future__ import annotations

import re

import pytest

from cxbridge_web.models import to_json
from tests.run.mini import AGENT, write_scenario
from tests.support import needs_plugin
from web_tests.support import read_events, serving

MORE = """
(deftemplate battery (slot level (type INTEGER)) (multislot notes))
(defrule mini-never (declare (salience -5)) (battery (level 1000)) (never) =>)
(defrule mini-low (battery (level ?l&:(< ?l 10))) => (assert (low)))
"""


@pytest.fixture(name="served", scope="module")
def _served(tmp_path_factory):
    scenario = write_scenario(tmp_path_factory.mktemp("own") / "mini", agent=AGENT + MORE)
    with serving(config=scenario) as (daemon, client, _):
        yield daemon, client


def test_rules_have_file_line_and_module(served):
    _, client = served
    rules = {rule["name"]: rule for rule in client.get("/api/cxbridge/rules").json}
    assert rules["mini-never"]["file"].endswith("mini.clp")
    assert rules["mini-never"]["line"] > rules["mini-begin"]["line"]
    assert rules["mini-never"]["module"] == "MAIN"
    assert "firings" not in rules["mini-never"]
    assert client.get("/api/cxbridge/rules?env=nope").status == 404


@needs_plugin("studio")
def test_firings_are_counted_during_stream(served):
    _, client = served
    with client.open("GET", "/api/cxbridge/events?kinds=rule") as stream:
        events = read_events(stream)
        next(events)
        next(events)
        assert (
            client.ask("POST", "/api/cxbridge/facts", {"fact": "(battery (level 3) (notes a b))"}).status
            == 200
        )
        for _, _, data in events:
            if data["rule"] == "mini-low":
                break
        rules = {rule["name"]: rule for rule in client.get("/api/cxbridge/rules").json}
        assert (rules["mini-low"]["firings"], rules["mini-never"]["firings"]) == (1, 0)


@needs_plugin("studio")
def test_facts_are_asserted_and_retracted(served):
    _, client = served
    answer = client.ask("POST", "/api/cxbridge/facts", {"fact": '(battery (level 50) (notes "full" x 1.5))'})
    index = answer.json["index"]
    facts = {fact["index"]: fact for fact in client.get("/api/clips/executive/facts").json}
    assert facts[index]["slots"] == [
        {"name": "level", "is-multifield": False, "values": ["50"]},
        {"name": "notes", "is-multifield": True, "values": ["full", "x", "1.500000"]},
    ]
    formatted = {fact["index"]: fact for fact in client.get("/api/clips/executive/facts?formatted=true").json}
    assert formatted[index]["formatted"] == '(battery (level 50) (notes "full" x 1.5))'
    assert client.ask("DELETE", f"/api/cxbridge/facts/{index}").json["index"] == index
    for method, path, body, status, message in (
        ("DELETE", f"/{index}", None, 404, "there is no fact"),
        ("DELETE", "/x", None, 400, "'index' must be a whole number"),
        ("POST", "", {"fct": "(a)"}, 400, "lacks 'fact'"),
        ("POST", "", {"fact": "(a)", "env": "nope"}, 404, "Environment 'nope' is unknown"),
    ):
        reply = client.ask(method, f"/api/cxbridge/facts{path}", body)
        assert (reply.status, message in reply.text) == (status, True), reply.text


@needs_plugin("studio")
def test_why_explains_rules_goals_actions_and_run(served):
    _, client = served
    answer = client.get("/api/cxbridge/why?rule=mini-never").json
    assert answer["kind"] == "Answer"
    assert any("mini-never" in line for line in answer["lines"])
    assert client.get("/api/cxbridge/why?goal=G").json["lines"][0].startswith("G (MINI) ")
    assert client.get("/api/cxbridge/why?action=G/1").json["data"]["actions"][0]["goal"] == "G (MINI)"
    story = client.get("/api/cxbridge/why").json["data"]
    assert story["wanted"][0]["text"].startswith("G (MINI)")
    assert "record with --trace-level rules" in story["unknown"][0]
    for query in (
        "?rule=",
        "?action=G/99",
        "?fact=f-1",
        "?rule=a&goal=b",
        "?rule=nope",
        f"?goal={'x' * 500}",
    ):
        assert client.get(f"/api/cxbridge/why{query}").status == 400, query


def test_why_without_executive_names_package():
    with serving((("executive", False),)) as (_, client, _lines):
        answer = client.get("/api/cxbridge/why?goal=G")
    assert (answer.status, "with cxbridge-studio" in answer.text) == (400, True), answer.text


def test_messages_are_sent_to_writer(served):
    daemon, client = served
    writer = daemon.board.open_for_writing("Position3DInterface", "/a/b", owner="test")
    path = "/api/cxbridge/blackboard/SwitchInterface/lamp/messages"
    lamp = daemon.board.open_for_writing("SwitchInterface", "lamp", owner="test")
    assert client.ask("POST", path, {"type": "Set", "fields": {"value": 0.5}}).json["msgid"] == 1
    message = lamp.msgq_pop()
    assert (message.type, message.value) == ("SetMessage", 0.5)
    assert client.get("/api/blackboard/interfaces/Position3DInterface//a/b/data").json["id"] == "/a/b"
    for body, text in (
        ({"type": "Nope"}, "does not match any known message type"),
        ({"type": "Set", "fields": {"vlaue": 1}}, "has no field 'vlaue'"),
        ({"type": "Set", "fields": {"value": "x"}}, "value"),
        ({"type": "Set", "fields": {"value": [1, {}]}}, "value"),
        ({"type": "Set", "fields": 3}, "must be an object"),
        ({}, "lacks 'type'"),
    ):
        answer = client.ask("POST", path, body)
        assert (answer.status, text in answer.text) == (400, True), answer.text
    assert client.ask("POST", path.replace("lamp", "nope"), {"type": "Set"}).status == 404
    lamp.close()
    writer.close()


def test_openapi_has_used_models_and_unique_operations(served):
    spec = served[1].get("/api/openapi.json").json
    used = str(spec["paths"]) + str(spec["components"]["schemas"])
    models = spec["components"]["schemas"]
    assert {name for name in models if f"schemas/{name}'" not in used} == set()
    assert {name for name in models if not name.isidentifier()} == set(), "two types have the same name"
    assert set(re.findall(r"schemas/(\w+)'", used)) <= set(models)
    assert "/cxbridge/events" in spec["paths"]
    ids = [operation["operationId"] for methods in spec["paths"].values() for operation in methods.values()]
    assert len(ids) == len(set(ids))


def test_json_has_neither_nan_nor_surrogates():
    assert to_json({"text": "\udcff", "number": float("nan")}) == b'{"text":"?","number":null}'


def test_pretty_indents_json(served):
    _, client = served
    assert client.get("/api/cxbridge/status?pretty").text.startswith('{\n    "kind"')
    assert client.get("/api/cxbridge/status").text.startswith('{"kind"')
    assert "no-store" in client.get("/api/cxbridge/status").headers["Cache-Control"]


def test_page_has_etag_and_policy():
    with serving((("executive", False),)) as (_, client, _lines):
        page = client.get("/")
        assert page.status == 200
        assert "<title>cxbridge</title>" in page.text
        assert "default-src 'self'" in page.headers["Content-Security-Policy"]
        assert page.headers["X-Content-Type-Options"] == "nosniff"
        assert client.get("/", If_None_Match=page.headers["ETag"]).status == 304
        assert client.get("/", If_None_Match='"other"').status == 200
        assert client.get("/", Accept_Encoding="gzip").headers["Content-Encoding"] == "gzip"
        for path in ("/nope", "/js/main.js", "/../secret", "/%2e%2e/secret", "/..%2fsecret", "/%00"):
            assert client.get(path).status == 404, path
        assert client.ask("POST", "/").status == 405
