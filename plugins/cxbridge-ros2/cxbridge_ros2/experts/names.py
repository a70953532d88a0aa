"""Names and types of the services of PlanSys2's experts and planner."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from cxbridge_ros2.experts.definitions import PACKAGE

PROBLEM: Final = {
    "add_problem": "AddProblem",
    "add_problem_goal": "AddProblemGoal",
    "add_problem_instance": "AffectParam",
    "add_problem_predicate": "AffectNode",
    "add_problem_function": "AffectNode",
    "get_problem": "GetProblem",
    "get_problem_goal": "GetProblemGoal",
    "get_problem_instance": "GetProblemInstanceDetails",
    "get_problem_instances": "GetProblemInstances",
    "get_problem_predicate": "GetNodeDetails",
    "get_problem_predicates": "GetStates",
    "get_problem_function": "GetNodeDetails",
    "get_problem_functions": "GetStates",
    "is_problem_goal_satisfied": "IsProblemGoalSatisfied",
    "remove_problem_goal": "RemoveProblemGoal",
    "clear_problem_knowledge": "ClearProblemKnowledge",
    "remove_problem_instance": "AffectParam",
    "remove_problem_predicate": "AffectNode",
    "remove_problem_function": "AffectNode",
    "exist_problem_predicate": "ExistNode",
    "exist_problem_function": "ExistNode",
    "update_problem_function": "AffectNode",
}
DOMAIN: Final = {
    "get_domain": "GetDomain",
    "get_domain_name": "GetDomainName",
    "get_domain_types": "GetDomainTypes",
    "get_domain_constants": "GetDomainConstants",
    "get_domain_actions": "GetDomainActions",
    "get_domain_action_details": "GetDomainActionDetails",
    "get_domain_durative_actions": "GetDomainActions",
    "get_domain_durative_action_details": "GetDomainDurativeActionDetails",
    "get_domain_predicates": "GetStates",
    "get_domain_predicate_details": "GetNodeDetails",
    "get_domain_functions": "GetStates",
    "get_domain_function_details": "GetNodeDetails",
    "get_domain_derived_predicates": "GetStates",
    "get_domain_derived_predicate_details": "GetDomainDerivedPredicateDetails",
}
PLANNER: Final = {"get_plan": "GetPlan", "validate_domain": "ValidateDomain"}

# Distributions whose PlanSys2 has no derived predicates and other numbers of nodes.
BEFORE_JAZZY: Final = ("humble", "iron")

# Services added by Jazzy; older packages lack some of their types.
SINCE_JAZZY: Final = (
    "/domain_expert/get_domain_derived_predicates",
    "/domain_expert/get_domain_derived_predicate_details",
    "/planner/validate_domain",
)

# Services of each node, with the names of their types.
NODES: Final[Mapping[str, Mapping[str, str]]] = {
    "problem": {f"/problem_expert/{name}": kind for name, kind in PROBLEM.items()},
    "domain": {f"/domain_expert/{name}": kind for name, kind in DOMAIN.items()},
    "planner": {f"/planner/{name}": kind for name, kind in PLANNER.items()},
}

# All services with their types.
SERVICES: Final = {
    name: f"{PACKAGE}/srv/{kind}" for services in NODES.values() for name, kind in services.items()
}


def services_of(node: str, distribution: str) -> Mapping[str, str]:
    """Return the services of a node in a distribution, with their types.

    :param node: a key of :data:`NODES`.
    """
    left_out = SINCE_JAZZY if distribution in BEFORE_JAZZY else ()
    return {name: SERVICES[name] for name in NODES[node] if name not in left_out}


# Topic for notifications about changes.
UPDATE: Final = ("/problem_expert/update_notify", "std_msgs/msg/Empty")

# Topic with the whole knowledge.
KNOWLEDGE: Final = ("/problem_expert/knowledge", f"{PACKAGE}/msg/Knowledge")

DEPTH: Final = 100  # queue depth of both topics
