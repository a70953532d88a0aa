"""The paths of Fawkes' REST API with the data of the test scenario."""

from __future__ import annotations

import re
from contextlib import contextmanager

import pytest

from cxbridge.executive.host.values import value_text
from cxbridge_web.fawkes import skiller
from tests.support import ROOT, needs_plugin
from web_tests.support import serving

SKILLS = "/api/skiller/skills"


@pytest.fixture(name="served", scope="module")
def _served():
    """The test scenario, paused during its run, so that its state stays."""
    with serving(config=ROOT / "scenarios" / "test-scenario") as (daemon, client, _):
        client.until(
            "/api/clips-executive/plans",
            lambda plans: any("preconditions" in action for plan in plans for action in plan["actions"]),
        )
        assert client.ask("POST", "/api/cxbridge/pause").status == 200
        yield daemon, client


def facts(daemon, template):
    """Return the slots of a template's facts, in order."""
    env = daemon.node.env
    with env.lock:
        return [slots for _, _, slots in env.facts(template)]


def text(value):
    """Return the text that Fawkes sends for a slot's value."""
    return "" if str(value) == "nil" else str(value)


LISTS = [
    (
        "goals",
        "goal",
        {"id": "id", "class": "class", "mode": "mode", "sub-type": "sub-type", "parent": "parent"},
    ),
    ("domain-operators", "domain-operator", {"name": "name"}),
    ("domain-objects", "domain-object", {"name": "name", "type": "type"}),
    ("domain-predicates", "domain-predicate", {"name": "name"}),
    ("domain-facts", "domain-fact", {"name": "name"}),
    ("pddl-groundings", "pddl-grounding", {"id": "id"}),
    ("pddl-predicates", "pddl-predicate", {"id": "id", "part-of": "part-of", "predicate": "predicate"}),
    ("pddl-formulas", "pddl-formula", {"id": "id", "part-of": "part-of", "type": "type"}),
    ("grounded-pddl-predicates", "grounded-pddl-predicate", {"id": "id", "predicate-id": "predicate-id"}),
    ("grounded-pddl-formulas", "grounded-pddl-formula", {"id": "id", "formula-id": "formula-id"}),
]


@pytest.mark.parametrize(("path", "template", "fields"), LISTS, ids=[path for path, _, _ in LISTS])
def test_lists_equal_facts_in_order(served, path, template, fields):
    daemon, client = served
    models = client.get(f"/api/clips-executive/{path}").json
    expected = [
        {name: text(slots[slot]) for name, slot in fields.items()} for slots in facts(daemon, template)
    ]
    assert [{name: model[name] for name in fields} for model in models] == expected
    assert models or template == "domain-object"


@pytest.mark.parametrize("path", [path for path, _, _ in LISTS if not path.startswith("domain-")])
def test_single_model_equals_model_of_list(served, path):
    _, client = served
    models = client.get(f"/api/clips-executive/{path}").json
    assert client.get(f"/api/clips-executive/{path}/{models[-1]['id']}").json == models[-1]
    answer = client.get(f"/api/clips-executive/{path}/nothing")
    assert answer.status == 400
    assert re.fullmatch(r"Goal 'nothing' is unknown|No [a-z ]+ with ID 'nothing' found", answer.text)


def test_plans_have_ordered_actions_and_goals_have_plans(served):
    daemon, client = served
    plans = client.get("/api/clips-executive/plans").json
    assert [(plan["goal-id"], plan["id"]) for plan in plans] == sorted(
        (str(slots["goal-id"]), str(slots["id"])) for slots in facts(daemon, "plan")
    )
    for plan in plans:
        ids = [action["id"] for action in plan["actions"]]
        assert ids == sorted(
            slots["id"] for slots in facts(daemon, "plan-action") if slots["plan-id"] == plan["id"]
        )
        assert client.get(f"/api/clips-executive/plans/{plan['goal-id']}/{plan['id']}").json == plan
        assert plan["id"] in client.get(f"/api/clips-executive/goals/{plan['goal-id']}").json["plans"]
    answer = client.get("/api/clips-executive/plans/G/P")
    assert (answer.status, answer.text) == (400, "No plan for goal 'G' with ID 'P' found")


def test_preconditions_are_trees_with_values(served):
    _, client = served
    actions = [action for plan in client.get("/api/clips-executive/plans").json for action in plan["actions"]]
    action = next(action for action in actions if "preconditions" in action)
    atoms = []

    def visit(node):
        assert node["kind"] == ("GroundedFormula" if node["child"] else "GroundedPredicate")
        atoms.extend([] if node["child"] else [node])
        for child in node["child"]:
            visit(child)

    visit(action["preconditions"])
    assert atoms
    for atom in atoms:
        assert atom["type"] == "atom"
        assert len(atom["param-values"]) == len(atom["param-names"]) == len(atom["param-constants"])
        arguments = dict(
            zip(action["precondition"]["param-names"], action["precondition"]["param-values"], strict=True)
        )
        constants = zip(atom["param-names"], atom["param-constants"], strict=True)
        assert atom["param-values"] == [arguments.get(name, constant) for name, constant in constants]
    assert any("nil" in atom["param-constants"] for atom in atoms)


def test_clips_facts_are_listed_formatted_and_filtered(served):
    daemon, client = served
    assert client.get("/api/clips/").json == [
        {"kind": "Environment", "apiVersion": "v1beta1", "name": "executive"}
    ]
    assert client.get("/api/clips").status == 404
    env = daemon.node.env
    with env.lock:
        expected = list(env.facts())
    models = client.get("/api/clips/executive/facts").json
    assert [(model["index"], model["template_name"]) for model in models] == [row[:2] for row in expected]
    for model, (_, _, slots) in zip(models, expected, strict=True):
        assert [slot["name"] for slot in model["slots"]] == list(slots)
        for slot in model["slots"]:
            assert slot["is-multifield"] == isinstance(slots[slot["name"]], tuple)
    formatted = client.get("/api/clips/executive/facts?formatted=true").json
    goal = next(model for model in formatted if model["template_name"] == "goal")
    slots = next(slots for index, _, slots in expected if index == goal["index"])
    assert goal["slots"] == []
    assert f"(class {value_text(slots['class'])})" in goal["formatted"]
    filtered = client.get("/api/clips/executive/facts?template=domain-ob*").json
    assert {model["index"] for model in filtered} == {
        index for index, template, _ in expected if template.startswith("domain-ob")
    }
    answer = client.get("/api/clips/nope/facts")
    assert (answer.status, answer.text) == (404, "Environment 'nope' is unknown")


def test_interfaces_have_description_and_values(served):
    daemon, client = served
    infos = client.get("/api/blackboard/interfaces").json
    assert [(info["type"], info["id"]) for info in infos] == [
        (info.type, info.id) for info in daemon.board.list_all()
    ]
    info = client.get("/api/blackboard/interfaces/SkillerInterface/Skiller").json
    assert info in infos
    assert [field["name"] for field in info["fields"]][:2] == ["skill_string", "error"]
    assert info["fields"][-1] == {
        "name": "status",
        "type": "SkillStatusEnum",
        "is_array": False,
        "enums": ["S_INACTIVE", "S_FINAL", "S_RUNNING", "S_FAILED"],
    }
    assert info["message_types"][0]["name"] == "ExecSkillMessage"
    data = client.get("/api/blackboard/interfaces/SkillerInterface/Skiller/data").json
    assert (data["writer"], data["readers"]) == (info["writer"], info["readers"])
    assert data["data"]["exclusive_controller"]
    assert data["data"]["status"] in info["fields"][-1]["enums"]
    assert re.fullmatch(r"\w{3} \w{3} [ \d]\d \d\d:\d\d:\d\d \d{4}", data["timestamp"])
    graph = client.get("/api/blackboard/graph").json
    assert graph["kind"] == "TransformsGraph"
    assert '"SkillerLua" -> "SkillerInterface::Skiller" [color="#008800"];' in graph["dotgraph"]


@pytest.mark.parametrize(
    ("path", "status", "message"),
    [
        ("T%2A/x", 400, "Type may not contain any of [*?]."),
        ("T/x%3F/data", 400, "ID may not contain any of [*?]."),
        ("T/x", 404, "Interface T:x not found"),
        ("T//x/data", 404, "Interface T::/x: is currently not available"),
    ],
)
def test_unknown_interface_is_error(served, path, status, message):
    answer = served[1].get(f"/api/blackboard/interfaces/{path}")
    assert (answer.status, answer.text) == (status, message)


def test_configuration_is_nested_and_typed(served):
    _, client = served
    full = client.get("/api/config/").json["config"]
    specs = client.get("/api/config?query=/clips-executive/specs/").json["config"]
    assert specs["clips-executive"]["specs"] == full["clips-executive"]["specs"]
    assert list(specs) == ["clips-executive"]
    assert full["cxbridge"]["web"] == {"enable": True, "port": 0}
    assert client.get("/api/config?query=/nothing").json["config"] == {}


@needs_plugin("robot-memory")
def test_configuration_hides_secrets():
    secret = (("web/token", "correct horse battery"), ("robot-memory/uri", "mongodb://me:pw@host:1/"))
    with serving((("executive", False), *secret)) as (_, client, _lines):
        client.headers["Authorization"] = "Bearer correct horse battery"
        for path in ("/api/config", "/api/config?query=/cxbridge/web"):
            answer = client.get(path)
            assert "horse" not in answer.text
            assert answer.json["config"]["cxbridge"]["web"]["token"] == "(not told)"
        uri = client.get("/api/config").json["config"]["cxbridge"]["robot-memory"]["uri"]
        assert uri == "mongodb://(not told)@host:1/"


def test_plugins_are_loaded_and_unloaded():
    with serving((("executive", False),)) as (_, client, _lines):
        plugins = client.get("/api/plugins/").json
        assert [(plugin["name"], plugin["is_loaded"]) for plugin in plugins] == [
            ("skiller", True),
            ("speech", True),
        ]
        for state, loaded in (("UNLOADED", False), ("LOADED", True), ("AVAILABLE", False)):
            answer = client.ask("PUT", "/api/plugins/skiller", {"desired_state": state}).json
            assert answer == {
                "kind": "PluginOpResponse",
                "apiVersion": "v1beta1",
                "name": "skiller",
                "state": state,
            }
            assert client.get("/api/plugins").json[0]["is_loaded"] is loaded
        for body, message in (
            ({}, "Request is missing required field 'desired_state'"),
            ({"desired_state": "GONE"}, "Unknown state requested"),
        ):
            answer = client.ask("PUT", "/api/plugins/skiller", body)
            assert answer.status == 400
            assert (answer.json["state"], answer.json["message"]) == ("ERROR", message)
        answer = client.ask("PUT", "/api/plugins/nothing", {"desired_state": "LOADED"})
        assert (answer.status, answer.json["state"]) == (400, "ERROR")
        assert client.get("/api/skiller/skills").status == 503


def test_backends_are_empty_and_transforms_are_graph(served):
    _, client = served
    assert client.get("/api/backends").json == []
    graph = client.get("/api/transforms/graph").json
    assert graph["kind"] == "TransformsGraph"
    assert graph["dotgraph"].startswith("digraph {")


# -- the skiller


def test_skills_are_listed_shown_called_and_stopped():
    with serving((("executive", False),)) as (_, client, _lines):
        names = [skill["name"] for skill in client.get("/api/skiller/skills").json]
        assert "say" in names
        assert client.get("/api/skiller/skills/say").json["graph"].startswith("digraph")
        assert client.get("/api/skiller/skills/nothing").json["graph"] == ""
        assert client.get(f"/api/skiller/skills/{'x' * 40}").status == 408
        called = client.ask("POST", "/api/skiller/call", {"skill_string": "wait{seconds=60.0}"})
        assert (called.status, called.json["name"], called.json["msg_id"]) == (200, "active", 1)
        active = client.until("/api/skiller/skills/active", lambda skill: skill["status"] == "RUNNING")
        assert (active["name"], active["skill-string"]) == ("ACTIVE", "wait{seconds=60.0}")
        assert active["exclusive_controller"] == ""
        stopped = client.ask("DELETE", "/api/skiller/skills/active")
        assert (stopped.status, stopped.text) == (200, "OK")
        stopped_skill = client.until("/api/skiller/skills/active", lambda skill: skill["status"] != "RUNNING")
        assert stopped_skill["exclusive_controller"] == ""


@contextmanager
def silent_skiller():
    """Yield a daemon's client and the debug interface of a second Skiller, which does not answer."""
    with serving((("executive", False),)) as (daemon, client, _):
        daemon.board.open_for_writing("SkillerInterface", "silent", owner="test")
        debug = daemon.board.open_for_writing("SkillerDebugInterface", "silent", owner="test")
        debug.set("graph_fsm", "goto")
        debug.write()
        yield client, debug


def test_list_without_answer_restores_shown_graph(monkeypatch):
    monkeypatch.setattr(skiller, "GRAPH_TIMEOUT_S", 0.2)
    with silent_skiller() as (client, debug):
        assert client.get("/api/skiller/skills?skiller=silent").status == 408
        assert [message.graph_fsm for message in iter(debug.msgq_pop, None)] == ["LIST", "goto"]


def test_second_skiller_is_selected_by_id():
    with serving() as (daemon, client, _):
        second = daemon.board.open_for_writing("SkillerInterface", "robot1", owner="test")
        called = client.ask("POST", "/api/skiller/call?skiller=robot1", {"skill_string": "go{}"})
        assert called.status == 200
        assert second.msgq_pop().skill_string == "go{}"
        assert client.get("/api/skiller/skills?skiller=robot1").status == 503
        assert client.get("/api/skiller/skills?skiller=unknown").status == 404
        daemon.board.close(second)


@pytest.mark.parametrize(
    ("method", "path", "body", "status", "message"),
    [
        ("POST", "call", {}, 400, "Request lacks skill string"),
        ("POST", "call", {"skill_string": 1}, 400, "Request lacks skill string"),
        ("POST", "call", {"skill_string": "x" * 2000}, 400, "1023 bytes"),
        ("POST", "call", [], 400, "The body is not a JSON object"),
        ("POST", "call", b"{", 400, "The body is not JSON"),
        ("POST", "call", b"x" * (2 << 20), 413, "longer than"),
        ("POST", "call", {"skill_string": "say{}"}, 409, "Another thread is exclusive controller"),
        ("DELETE", "skills/active", None, 409, "Another thread is exclusive controller"),
        ("DELETE", "skills/say", None, 400, "Only the 'active' skill can be stopped"),
    ],
)
def test_invalid_skill_call_is_refused(served, method, path, body, status, message):
    _, client = served
    answer = client.ask(method, f"/api/skiller/{path}", body)
    assert (answer.status, message in answer.text) == (status, True)


def test_form_is_refused_as_body(served):
    answer = served[1].ask(
        "POST", "/api/skiller/call", b"a=b", Content_Type="application/x-www-form-urlencoded"
    )
    assert (answer.status, "Content-Type" in answer.text) == (400, True)
