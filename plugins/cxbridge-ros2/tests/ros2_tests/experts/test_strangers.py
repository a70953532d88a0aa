"""PlanSys2's own nodes, messages and terminal: ours in their place, and our prompt with theirs."""

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
from cxbridge_ros2.experts.nodes import NodeCodec
from cxbridge_ros2.experts.terminal import Terminal
from cxbridge_ros2.lifecycle import ACTIVATE, CONFIGURE
from cxbridge_ros2.names import parse_type
from ros2_tests.clients import LifecycleClient
from ros2_tests.conftest import find_package, in_ros, needs_ros
from ros2_tests.experts.agents import AGENT, asking, served
from ros2_tests.experts.test_services import RIGHT, WHOLE, WRONG, refill
from ros2_tests.test_managed import answer

pytestmark = needs_ros
LATER = ("Derived", "GetDomainDerivedPredicateDetails", "ValidateDomain")
"""Came with Jazzy, or is part of a separate package."""

OTHERS = (
    "get_plan",
    "get_domain_constants",
    "get_domain_derived_predicates",
    "get_domain_derived_predicate_details",
    "validate_domain",
)
"""Services that Iron's experts do not have, or that answer what only ours knows."""

CRASHES = ("has no end", "has no node 7", "is not a condition")
"""Trees that end their node."""

DIFFERENT = {
    ("add_problem_goal", ""): "false: a constant is no instance before a problem was added",
    ("get_problem_instances", ""): "without constants, until a problem was added",
    ("add_problem", "'hall' already has the type room"): "true: it adds the rest",
    ("add_problem_instance", "'dock' already has the type place"): "true",
    ("add_problem_instance", "'a b' is not a valid name"): "true: any text is a name",
    ("add_problem_instance", "is not a valid name"): "true: any text is a name",
}
"""Requests that are answered otherwise, and how theirs is."""


def needs(package: str) -> Path:
    """Skip the test without a package; return the prefix of the package."""
    return find_package(package) or pytest.skip(f"this ROS 2 has no {package}")


# ---- messages


def test_the_hashes_of_the_types_are_theirs():
    ours = Definitions(environment={}, texts=TYPE_DEFINITIONS)
    share = needs("plansys2_msgs") / "share" / "plansys2_msgs"
    checked = 0
    for name in TYPE_DEFINITIONS:
        kind = parse_type(name)
        file = share / kind.kind / f"{kind.name}.json"
        if not file.is_file():
            assert kind.name in LATER
            continue
        hashes = {
            each["type_name"]: each["hash_string"] for each in json.loads(file.read_text())["type_hashes"]
        }
        assert ours.compute_type_hash(kind) == hashes[name], name
        checked += 1
    assert checked == len(TYPE_DEFINITIONS) - len(LATER)


# ---- their client asks our servers


TYPED = """\
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


SAID = (
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
"""What their terminal says to these commands."""


def test_their_terminal_asks_ours(domain: int, tmp_path: Path):
    program = needs("plansys2_terminal") / "lib" / "plansys2_terminal" / "plansys2_terminal"
    with served(tmp_path, domain) as daemon:
        done = subprocess.run(
            in_ros(str(program)),
            input=TYPED,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=120,
            check=False,
        )
        for text in SAID:
            assert text in done.stdout, text
        assert daemon.node is not None
        env = daemon.node.env
        assert env is not None
        with env.lock:
            formulas = [str(formula) for (formula,) in env.columns("problem-goal", "formula")]
        assert formulas == ["(and (clean hall))"]


# ---- our clients ask other servers


@contextmanager
def their_node(package: str, program: str, *parameters: str) -> Iterator[None]:
    command = [str(needs(package) / "lib" / package / program), "--ros-args"]
    command += [word for each in parameters for word in ("-p", each)]
    with subprocess.Popen(in_ros(*command), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        yield
        process.kill()


def lead(client: ExpertClient, name: str) -> None:
    """Bring a managed node to life."""
    node = LifecycleClient(client.node, name)
    assert client.wait(lambda: node.has_server, 20)
    for change in (CONFIGURE, ACTIVATE):
        assert answer(client.node, partial(node.change, change)) is True


@pytest.fixture(scope="module")
def theirs(domain: int) -> Iterator[ExpertClient]:
    """Their experts, with the domain of our agent."""
    model = f"model_file:={AGENT / 'domain.pddl'}"
    with (
        their_node("plansys2_problem_expert", "problem_expert_node", model),
        their_node("plansys2_domain_expert", "domain_expert_node", model),
        asking(domain) as client,
    ):
        for name in ("/problem_expert", "/domain_expert"):
            lead(client, name)
        yield client


def plain(value: Any) -> Any:
    """Return a response without what theirs leaves out, or has in another order."""
    if isinstance(value, dict):
        left_out = ("error_info", "problem", "domain", "type", "node_type", "negate")
        return {name: plain(each) for name, each in value.items() if name not in left_out}
    return [plain(each) for each in value] if isinstance(value, list) else value


def test_each_answer_is_theirs(theirs: ExpertClient, domain: int, tmp_path: Path):
    """Right and wrong requests to both: success, and the answer."""
    asked = [(name, request, "") for name, request in RIGHT.items()] + [*WRONG]
    different = {}
    with served(tmp_path, domain + 3), asking(domain + 3) as ours:
        for name, request, message in asked:
            if name in OTHERS or message in CRASHES:
                continue
            refill(theirs)
            refill(ours)
            there, here = theirs.call(WHOLE[name], request, 20), ours.call(WHOLE[name], request, 20)
            if there["success"] != here["success"] or (there["success"] and plain(there) != plain(here)):
                different[name, message] = (there, here)
    assert different.keys() == DIFFERENT.keys(), different


def test_their_texts_are_read_here(theirs: ExpertClient):
    refill(theirs)
    domain = parse_domain(theirs.request(WHOLE["get_domain"])["domain"])
    problem = parse_problem(theirs.request(WHOLE["get_problem"])["problem"], domain)
    assert [names.names for names in problem.objects] == [("r2",), ("hall",)]


def test_their_planner_reads_our_texts(domain: int, tmp_path: Path):
    needs("plansys2_popf_plan_solver")
    other = domain + 10
    with (
        pytest.MonkeyPatch.context() as patch,
        served(tmp_path, other, experts=", serve: [domain, problem]"),
        asking(other) as client,
    ):
        patch.setenv("ROS_DOMAIN_ID", str(other))
        with their_node("plansys2_planner", "planner_node"):
            lead(client, "/planner")
            terminal = Terminal(client, NodeCodec("iron"))
            list(terminal.run_line("set function (= (battery r2) 3)"))
            list(terminal.run_line("set goal (and (at r2 dock))"))
            (step,) = list(terminal.run_line("get plan"))
            assert step == "0.000: (move r2 hall dock) [5.000]"
