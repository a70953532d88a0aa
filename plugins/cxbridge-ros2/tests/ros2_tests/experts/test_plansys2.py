"""The nodes, messages and terminal of PlanSys2, with the services and clients of cxbridge."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.executive.pddl import parse_domain, parse_problem
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.experts.client import ExpertClient
from cxbridge_ros2.experts.definitions import TYPE_DEFINITIONS
from cxbridge_ros2.experts.terminal import Terminal
from cxbridge_ros2.experts.trees import TreeCodec
from cxbridge_ros2.lifecycle import ACTIVATE, CONFIGURE
from cxbridge_ros2.names import parse_type
from ros2_tests.clients import LifecycleClient
from ros2_tests.conftest import find_package, make_ros_command, needs_ros
from ros2_tests.experts.agents import AGENT, join_client, run_agent
from ros2_tests.experts.test_services import INVALID_REQUESTS, SERVICE_NAMES, VALID_REQUESTS, restore_world
from ros2_tests.test_managed import wait_for_answer

pytestmark = needs_ros
TYPES_WITHOUT_HASH = ("Derived", "GetDomainDerivedPredicateDetails", "ValidateDomain")
"""Types that came with Jazzy or belong to a separate package."""

INCOMPARABLE_SERVICES = (
    "get_plan",
    "get_domain_constants",
    "get_domain_derived_predicates",
    "get_domain_derived_predicate_details",
    "validate_domain",
)
"""Services that Iron's experts lack, or whose responses have data that only cxbridge has."""

CRASH_MESSAGES = ("has no end", "has no node 7", "is not a condition")
"""Messages of cxbridge about trees that crash the node of PlanSys2."""

DIFFERENCES = {
    ("add_problem_goal", ""): "false: a constant is no instance before a problem was added",
    ("get_problem_instances", ""): "without constants, until a problem was added",
    ("add_problem", "'hall' already has the type room"): "true: it adds the rest",
    ("add_problem_instance", "'dock' already has the type place"): "true",
    ("add_problem_instance", "'a b' is not a valid name"): "true: any text is a name",
    ("add_problem_instance", "is not a valid name"): "true: any text is a name",
}
"""Requests with a different response, and the response of PlanSys2."""


def require_package(package: str) -> Path:
    """Skip the test without a package; return the prefix of the package."""
    return find_package(package) or pytest.skip(f"this ROS 2 has no {package}")


# ---- messages


def test_type_hashes_equal_those_of_plansys2():
    ours = Definitions(environment={}, texts=TYPE_DEFINITIONS)
    share = require_package("plansys2_msgs") / "share" / "plansys2_msgs"
    checked = 0
    for name in TYPE_DEFINITIONS:
        kind = parse_type(name)
        file = share / kind.kind / f"{kind.name}.json"
        if not file.is_file():
            assert kind.name in TYPES_WITHOUT_HASH
            continue
        hashes = {
            each["type_name"]: each["hash_string"] for each in json.loads(file.read_text())["type_hashes"]
        }
        assert ours.compute_type_hash(kind) == hashes[name], name
        checked += 1
    assert checked == len(TYPE_DEFINITIONS) - len(TYPES_WITHOUT_HASH)


# ---- the client of PlanSys2 and our servers


COMMANDS = """\
get model types
get model actions
get model action sweep
set instance attic room
set predicate (clean attic)
set function (= (battery r2) 3)
set goal (and (clean hall) (clean attic))
get problem instances
get problem predicates
get problem functions
get problem goal
set instance x boat
remove predicate (clean attic)
remove instance attic
get problem goal
quit
"""


EXPECTED_OUTPUT = (
    "Types: 3",
    "sweep (action)",
    "move (durative action)",
    "Preconditions: (and (at ?0 ?1)(not (clean ?1)))",
    "attic\troom",
    "(clean attic)",
    "Functions: 1",
    "Goal: (and (clean hall)(clean attic))",
    "Could not add the instance [x]",
    "Goal: (and (clean hall))",
)
"""The output of PlanSys2's terminal for the commands."""


def test_plansys2_terminal_uses_our_services(domain: int, tmp_path: Path):
    program = require_package("plansys2_terminal") / "lib" / "plansys2_terminal" / "plansys2_terminal"
    with run_agent(tmp_path, domain) as daemon:
        result = subprocess.run(
            make_ros_command(str(program)),
            input=COMMANDS,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=120,
            check=False,
        )
        for text in EXPECTED_OUTPUT:
            assert text in result.stdout, text
        assert daemon.node is not None
        env = daemon.node.env
        assert env is not None
        with env.lock:
            formulas = [str(formula) for (formula,) in env.columns("problem-goal", "formula")]
        assert formulas == ["(and (clean hall))"]


# ---- our clients and the servers of PlanSys2


@contextmanager
def run_plansys2_node(package: str, program: str, *parameters: str) -> Iterator[None]:
    command = [str(require_package(package) / "lib" / package / program), "--ros-args"]
    command += [word for each in parameters for word in ("-p", each)]
    with subprocess.Popen(
        make_ros_command(*command), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        yield
        process.kill()


def activate(client: ExpertClient, name: str) -> None:
    """Configure and activate a managed node."""
    node = LifecycleClient(client.node, name)
    assert client.wait(lambda: node.has_server, 20)
    for change in (CONFIGURE, ACTIVATE):
        assert wait_for_answer(client.node, partial(node.change, change)) is True


@pytest.fixture(scope="module")
def plansys2_client(domain: int) -> Iterator[ExpertClient]:
    """Run the experts of PlanSys2 with the domain of our agent."""
    model = f"model_file:={AGENT / 'domain.pddl'}"
    with (
        run_plansys2_node("plansys2_problem_expert", "problem_expert_node", model),
        run_plansys2_node("plansys2_domain_expert", "domain_expert_node", model),
        join_client(domain) as client,
    ):
        for name in ("/problem_expert", "/domain_expert"):
            activate(client, name)
        yield client


def comparable(value: Any) -> Any:
    """Return a response without the fields that PlanSys2 leaves out or orders differently."""
    if isinstance(value, dict):
        left_out = ("error_info", "problem", "domain", "type", "node_type", "negate")
        return {name: comparable(each) for name, each in value.items() if name not in left_out}
    return [comparable(each) for each in value] if isinstance(value, list) else value


def test_responses_equal_those_of_plansys2(plansys2_client: ExpertClient, domain: int, tmp_path: Path):
    """Valid and invalid requests have the same success and the same response."""
    requests = [(name, request, "") for name, request in VALID_REQUESTS.items()] + [*INVALID_REQUESTS]
    differences = {}
    with run_agent(tmp_path, domain + 3), join_client(domain + 3) as ours:
        for name, request, message in requests:
            if name in INCOMPARABLE_SERVICES or message in CRASH_MESSAGES:
                continue
            restore_world(plansys2_client)
            restore_world(ours)
            plansys2_response, our_response = (
                plansys2_client.call(SERVICE_NAMES[name], request, 20),
                ours.call(SERVICE_NAMES[name], request, 20),
            )
            if plansys2_response["success"] != our_response["success"] or (
                plansys2_response["success"] and comparable(plansys2_response) != comparable(our_response)
            ):
                differences[name, message] = (plansys2_response, our_response)
    assert differences.keys() == DIFFERENCES.keys(), differences


def test_our_parser_reads_texts_of_plansys2(plansys2_client: ExpertClient):
    restore_world(plansys2_client)
    domain = parse_domain(plansys2_client.request(SERVICE_NAMES["get_domain"])["domain"])
    problem = parse_problem(plansys2_client.request(SERVICE_NAMES["get_problem"])["problem"], domain)
    assert [names.names for names in problem.objects] == [("r2",), ("hall",)]


def test_plansys2_planner_reads_our_texts(domain: int, tmp_path: Path):
    require_package("plansys2_popf_plan_solver")
    planner_domain = domain + 10
    with (
        pytest.MonkeyPatch.context() as patch,
        run_agent(tmp_path, planner_domain, experts=", serve: [domain, problem]"),
        join_client(planner_domain) as client,
    ):
        patch.setenv("ROS_DOMAIN_ID", str(planner_domain))
        with run_plansys2_node("plansys2_planner", "planner_node"):
            activate(client, "/planner")
            terminal = Terminal(client, TreeCodec("iron"))
            list(terminal.run_line("set function (= (battery r2) 3)"))
            list(terminal.run_line("set goal (and (at r2 dock))"))
            (step,) = list(terminal.run_line("get plan"))
            assert step == "0.000: (move r2 hall dock) [5.000]"
