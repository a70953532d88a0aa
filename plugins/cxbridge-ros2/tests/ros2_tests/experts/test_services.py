"""Every service of the experts and the planner, with valid and invalid requests, over DDS."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.executive.pddl import parse_formula
from cxbridge_ros2.experts.client import ExpertClient
from cxbridge_ros2.experts.definitions import (
    KNOWLEDGE_TOPIC_AND_TYPE,
    SERVICE_TYPES,
    SERVICES_BY_NODE,
    SINCE_JAZZY,
    UPDATE_TOPIC_AND_TYPE,
)
from cxbridge_ros2.experts.domain_services import DOMAIN_SERVICES
from cxbridge_ros2.experts.problem_services import PROBLEM_SERVICES
from cxbridge_ros2.experts.trees import TreeCodec, TreeNodeKind, make_ground_node, make_param
from cxbridge_ros2.qos import QosProfile
from ros2_tests.experts.agents import AGENT, MEETING, join_client, run_agent

CODEC = TreeCodec("iron")
MEETING_DOMAIN = (MEETING / "domain.pddl").read_text()
MEETING_PROBLEM = (MEETING / "problem.pddl").read_text()


def make_predicate(*words: str) -> dict[str, Any]:
    return {"node": make_ground_node(TreeNodeKind.PREDICATE, (words[0], words[1:]), {})}


def make_function(value: float, *words: str) -> dict[str, Any]:
    return {"node": make_ground_node(TreeNodeKind.FUNCTION, (words[0], words[1:]), {}, value)}


def make_goal(text: str) -> dict[str, Any]:
    return {"tree": CODEC.encode_formula(parse_formula(text), {})}


def make_instance(name: str, kind: str = "") -> dict[str, Any]:
    return {"param": make_param(name, kind)}


PROBLEM_TEXT = """
(define (problem more) (:domain tour)
  (:objects attic - room r3 - robot)
  (:init (at r3 attic) (= (battery r3) 7))
  (:goal (clean attic)))"""

VALID_REQUESTS = {
    "add_problem": {"problem": PROBLEM_TEXT},
    "add_problem_goal": make_goal("(and (clean hall) (not (at r2 dock)))"),
    "add_problem_instance": make_instance("cellar", "room"),
    "add_problem_predicate": make_predicate("clean", "hall"),
    "add_problem_function": make_function(2.5, "battery", "r2"),
    "get_problem": {},
    "get_problem_goal": {},
    "get_problem_instance": {"instance": "r2"},
    "get_problem_instances": {},
    "get_problem_predicate": {"expression": "(at r2 hall)"},
    "get_problem_predicates": {},
    "get_problem_function": {"expression": "(= (battery r2) 3)"},
    "get_problem_functions": {},
    "is_problem_goal_satisfied": make_goal("(at r2 hall)"),
    "remove_problem_goal": {},
    "clear_problem_knowledge": {},
    "remove_problem_instance": make_instance("r2"),
    "remove_problem_predicate": make_predicate("at", "r2", "hall"),
    "remove_problem_function": make_function(0, "battery", "r2"),
    "update_problem_function": make_function(9, "battery", "r2"),
    "get_domain": {},
    "get_domain_name": {},
    "get_domain_types": {},
    "get_domain_constants": {"type": "place"},
    "get_domain_actions": {},
    "get_domain_action_details": {"action": "sweep"},
    "get_domain_durative_actions": {},
    "get_domain_durative_action_details": {"durative_action": "move", "parameters": ["r2", "a", "b"]},
    "get_domain_predicates": {},
    "get_domain_predicate_details": {"expression": "AT"},
    "get_domain_functions": {},
    "get_domain_function_details": {"expression": "distance"},
    "get_domain_derived_predicates": {},
    "get_plan": {"domain": MEETING_DOMAIN, "problem": MEETING_PROBLEM},
    "validate_domain": {"domain": MEETING_DOMAIN},
}
INVALID_REQUESTS: tuple[tuple[str, Any, str], ...] = (
    ("add_problem", {}, "Problem not valid: "),
    ("add_problem", {"problem": PROBLEM_TEXT.replace("tour", "walk")}, "to the domain walk, not to tour"),
    ("add_problem", {"problem": PROBLEM_TEXT.replace("r3", "hall")}, "'hall' already has the type room"),
    ("add_problem_goal", {}, "Goal not valid: Malformed expression"),
    ("add_problem_goal", make_goal("(clean nowhere)"), "Unknown constant nowhere"),
    ("add_problem_goal", make_goal("(clean dock)"), "Type missmatch"),
    ("add_problem_goal", make_goal("(>= (speed r2) 1)"), "Unknown function: speed"),
    ("add_problem_goal", {"tree": {"nodes": [{"node_type": 1, "children": [0]}]}}, "has two parents"),
    ("add_problem_goal", {"tree": {"nodes": [{"node_type": 1, "children": [7]}]}}, "has no node 7"),
    ("add_problem_goal", {"tree": {"nodes": [{"node_type": 99}]}}, "is not a condition"),
    ("add_problem_instance", make_instance("x", "boat"), "has no type 'boat'"),
    ("add_problem_instance", make_instance("hall", "robot"), "'hall' already has the type room"),
    ("add_problem_instance", make_instance("dock", "robot"), "'dock' already has the type place"),
    ("add_problem_instance", make_instance("a b", "robot"), "'a b' is not a valid name"),
    ("add_problem_instance", make_instance('"x', "robot"), "is not a valid name"),
    ("add_problem_predicate", make_predicate("flies", "r2"), "Unknown predicate: flies"),
    ("add_problem_predicate", make_predicate("at", "r2"), "expected 2 but got 1"),
    ("add_problem_predicate", make_predicate("at", "hall", "r2"), "Type missmatch"),
    ("add_problem_predicate", make_predicate("at", "?r", "hall"), "Unknown constant ?r"),
    ("add_problem_function", make_function(1, "speed", "r2"), "Unknown function: speed"),
    ("add_problem_function", make_function(1, "battery", "r9"), "Unknown constant r9"),
    ("get_problem_instance", {"instance": "r9"}, "Instance not found: there is no instance 'r9'"),
    ("get_problem_predicate", {"expression": "(clean hall)"}, "Predicate not found: (clean hall)"),
    ("get_problem_function", {"expression": "(distance dock hall)"}, "Function not found: "),
    ("is_problem_goal_satisfied", {"tree": {"nodes": [{"node_type": 8}]}}, "is not a condition"),
    ("remove_problem_instance", make_instance("r9"), "Error removing instance: 'r9' is not an instance"),
    ("remove_problem_instance", make_instance("dock"), "'dock' is a constant of the domain, not an instance"),
    ("remove_problem_predicate", make_predicate("flies"), "Error removing predicate: Unknown predicate"),
    ("remove_problem_function", make_function(0, "speed"), "Error removing function: Unknown function"),
    (
        "update_problem_function",
        make_function(1, "distance", "dock", "hall"),
        "(distance dock hall) has no value",
    ),
    ("get_domain_constants", {"type": "boat"}, "Type not found: "),
    ("get_domain_action_details", {"action": "move"}, "Action not found: the domain has no action 'move'"),
    ("get_domain_durative_action_details", {"durative_action": "fly"}, "Durative action not found: "),
    ("get_domain_predicate_details", {"expression": "flies"}, "Predicate not found: "),
    ("get_domain_function_details", {"expression": "at"}, "Function not found: "),
    ("get_domain_derived_predicate_details", {"predicate": "near"}, "Derived predicate not found: "),
    ("get_plan", {}, "Plan not found: "),
    ("get_plan", {"domain": MEETING_DOMAIN, "problem": "(define"}, "Plan not found: "),
    ("validate_domain", {"domain": "(define (domain"}, "Domain is not valid: "),
)
SERVICE_NAMES = {name.rpartition("/")[2]: name for name in SERVICE_TYPES}


@pytest.fixture(scope="module")
def experts(domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ExpertClient]:
    with run_agent(tmp_path_factory.mktemp("daemon"), domain), join_client(domain) as client:
        yield client


@pytest.fixture
def client(experts: ExpertClient) -> ExpertClient:
    restore_world(experts)
    return experts


def restore_world(experts: ExpertClient) -> None:
    """Restore the world of the agent, and add the charge of the battery."""
    experts.request(SERVICE_NAMES["clear_problem_knowledge"])
    for name, kind in (("r2", "robot"), ("hall", "room")):
        experts.request(SERVICE_NAMES["add_problem_instance"], make_instance(name, kind))
    experts.request(SERVICE_NAMES["add_problem_predicate"], make_predicate("at", "r2", "hall"))
    experts.request(SERVICE_NAMES["add_problem_function"], make_function(3, "battery", "r2"))


def test_tables_have_each_service():
    assert SERVICES_BY_NODE["problem"].keys() == PROBLEM_SERVICES.keys()
    assert SERVICES_BY_NODE["domain"].keys() == DOMAIN_SERVICES.keys()
    requested = (
        VALID_REQUESTS.keys() | {name for name, _, _ in INVALID_REQUESTS} | {"exist_problem_predicate"}
    )
    assert SERVICE_NAMES.keys() - requested == {"exist_problem_function"}


@pytest.mark.parametrize("name", [name for name in VALID_REQUESTS if SERVICE_NAMES[name] not in SINCE_JAZZY])
def test_valid_requests_succeed(client: ExpertClient, name: str):
    response = client.call(SERVICE_NAMES[name], VALID_REQUESTS[name], 30)
    assert (response["success"], response["error_info"]) == (True, "")


@pytest.mark.parametrize(
    ("name", "request_", "message"),
    [each for each in INVALID_REQUESTS if SERVICE_NAMES[each[0]] not in SINCE_JAZZY],
)
def test_invalid_requests_fail_without_changes(
    client: ExpertClient, name: str, request_: dict[str, Any], message: str
):
    before = read_problem(client)
    response = client.call(SERVICE_NAMES[name], request_)
    assert response["success"] is False
    assert message in response["error_info"]
    assert read_problem(client) == before


def test_services_of_jazzy_answer_requests(domain: int, tmp_path: Path, experts: ExpertClient):
    clients = [experts.node.create_client(name, SERVICE_TYPES[name]) for name in SINCE_JAZZY]
    experts.wait(lambda: False, 1)
    assert not any(each.has_server for each in clients)
    with (
        run_agent(tmp_path, domain, experts=", distribution: jazzy, namespace: /jazzy") as _,
        join_client(domain, "/jazzy") as client,
    ):
        for name in SINCE_JAZZY:
            last = name.rpartition("/")[2]
            if last in VALID_REQUESTS:
                client.request(name, VALID_REQUESTS[last])
        for last, request, message in INVALID_REQUESTS:
            if SERVICE_NAMES[last] in SINCE_JAZZY:
                assert message in client.call(SERVICE_NAMES[last], request)["error_info"]


def read_problem(client: ExpertClient) -> str:
    return str(client.request(SERVICE_NAMES["get_problem"])["problem"])


def test_problem_has_instances_predicates_and_functions(client: ExpertClient):
    for kind, request, exists in (
        ("predicate", make_predicate("at", "r2", "hall"), True),
        ("predicate", make_predicate("at", "r2", "dock"), False),
        ("function", make_function(0, "battery", "r2"), True),
        ("function", make_function(0, "battery", "hall"), False),
    ):
        assert client.call(SERVICE_NAMES[f"exist_problem_{kind}"], request)["exist"] is exists
    instances = client.request(SERVICE_NAMES["get_problem_instances"])["instances"]
    assert [(each["name"], each["type"]) for each in instances] == [
        ("dock", "place"),
        ("r2", "robot"),
        ("hall", "room"),
    ]
    node = client.request(SERVICE_NAMES["get_problem_function"], {"expression": "(battery r2)"})["node"]
    assert (node["node_type"], node["value"]) == (6, 3.0)
    client.request(SERVICE_NAMES["update_problem_function"], make_function(9, "battery", "r2"))
    (node,) = client.request(SERVICE_NAMES["get_problem_functions"])["states"]
    assert node["value"] == 9.0


def test_added_problem_extends_knowledge(client: ExpertClient):
    client.request(SERVICE_NAMES["add_problem"], {"problem": PROBLEM_TEXT})
    text = read_problem(client)
    for part in (
        "r2 - robot",
        "attic - room",
        "(at r3 attic)",
        "(= (battery r3) 7)",
        "(:goal (clean attic))",
    ):
        assert part in text


@pytest.mark.parametrize(
    ("text", "satisfied"),
    [
        ("(at r2 hall)", True),
        ("(not (clean hall))", True),
        ("(or (clean hall) (at r2 hall))", True),
        ("(and (clean hall) (at r2 hall))", False),
        ("(>= (battery r2) 3)", True),
        ("(> (+ (battery r2) 1) 4)", False),
        ("(= (distance dock hall) 0)", False),  # the distance has no value
    ],
)
def test_satisfaction_of_goals(client: ExpertClient, text: str, satisfied: bool):
    assert (
        client.request(SERVICE_NAMES["is_problem_goal_satisfied"], make_goal(text))["satisfied"] is satisfied
    )


def test_domain_has_name_constants_and_predicates(client: ExpertClient):
    assert client.request(SERVICE_NAMES["get_domain_name"])["name"] == "tour"
    assert client.request(SERVICE_NAMES["get_domain_constants"], {"type": "Place"})["constants"] == ["dock"]
    node = client.request(SERVICE_NAMES["get_domain_predicate_details"], {"expression": "at"})["node"]
    assert [(each["name"], each["type"], each["sub_types"]) for each in node["parameters"]] == [
        ("?robot0", "robot", []),
        ("?place1", "place", ["room"]),
    ]


def test_details_of_actions(client: ExpertClient):
    request = {"action": "sweep", "parameters": ["r2"]}
    action = client.request(SERVICE_NAMES["get_domain_action_details"], request)["action"]
    assert [each["name"] for each in action["parameters"]] == ["r2", "?1"]
    assert CODEC.decode_tree(action["preconditions"]) == parse_formula("(and (at r2 ?1) (not (clean ?1)))")
    request = {"durative_action": "move", "parameters": ["r2", "a", "b"]}
    action = client.request(SERVICE_NAMES["get_domain_durative_action_details"], request)["durative_action"]
    assert {
        field: CODEC.decode_tree(tree)
        for field, tree in action.items()
        if field.endswith(("requirements", "effects"))
    } == {
        "at_start_requirements": parse_formula("(and (at r2 a))"),
        "over_all_requirements": parse_formula("(and (open))"),
        "at_end_requirements": parse_formula("(and)"),
        "at_start_effects": parse_formula("(and (not (at r2 a)))"),
        "at_end_effects": parse_formula("(and (at r2 b))"),
    }


def test_plan_has_actions_in_order(client: ExpertClient):
    plan = client.request(SERVICE_NAMES["get_plan"], VALID_REQUESTS["get_plan"], 30)["plan"]
    assert [each["action"] for each in plan["items"]] == ["(say-hello PEGGY)", "(say-goodbye PEGGY)"]
    assert plan["items"][0]["time"] < plan["items"][1]["time"]


def test_changes_are_published(client: ExpertClient):
    updates: list[Any] = []
    knowledge: list[Any] = []
    ends = [
        client.node.subscribe(*UPDATE_TOPIC_AND_TYPE, updates.append),
        client.node.subscribe(
            *KNOWLEDGE_TOPIC_AND_TYPE, knowledge.append, QosProfile(durability="transient_local")
        ),
    ]
    assert client.wait(lambda: bool(knowledge), 10)  # a late subscription gets the present knowledge
    client.wait(lambda: False, 1)
    updates.clear()
    client.request(SERVICE_NAMES["add_problem_predicate"], make_predicate("clean", "hall"))
    assert client.wait(lambda: bool(updates) and "(clean hall)" in knowledge[-1]["predicates"], 10)
    assert knowledge[-1]["instances"] == ["r2", "hall"]
    assert knowledge[-1]["functions"] == ["(battery r2)"]
    for end in ends:
        end()


def test_requests_read_and_change_facts_of_agent(domain: int, tmp_path: Path):
    with (
        run_agent(tmp_path, domain, AGENT, ", namespace: /robot7") as daemon,
        join_client(domain, "/robot7") as client,
    ):
        assert "(at r2 hall)" in read_problem(client)
        client.request(SERVICE_NAMES["remove_problem_predicate"], make_predicate("at", "r2", "hall"))
        client.request(SERVICE_NAMES["add_problem_predicate"], make_predicate("at", "r2", "dock"))
        client.request(SERVICE_NAMES["remove_problem_instance"], make_instance("hall"))
        assert daemon.node is not None
        env = daemon.node.env
        assert env is not None
        with env.lock:
            facts = [[*map(str, slots["param-values"])] for _, _, slots in env.facts("domain-fact")]
            kinds = [slots["implied"] for _, _, slots in env.facts("domain-obj-is-of-type")]
        assert sorted(facts) == [[], ["r2", "dock"]]
        assert [each for each in kinds if isinstance(each, tuple) and each[0] == "hall"] == []
