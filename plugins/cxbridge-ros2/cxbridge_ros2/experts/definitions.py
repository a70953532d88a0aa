"""PlanSys2's services and topics: their names, their types, and the definitions of the types.

The definitions are for machines without PlanSys2's package. They are the same since Humble, except the types
about derived predicates, which Jazzy added.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

PACKAGE: Final = "plansys2_msgs"

# fields of requests and responses, separated by commas
_EMPTY: Final = "std_msgs/Empty request"
_DONE: Final = "bool success, string error_info"

_MESSAGES: Final = {
    "Param": "string name, string type, string[] sub_types",
    "Node": "uint8 node_type, uint8 expression_type, uint8 modifier_type, uint32 node_id, uint32[] children,"
    " string name, Param[] parameters, float64 value, bool negate",
    "Tree": "Node[] nodes",
    "Knowledge": "string[] instances, string[] predicates, string[] functions, string goal",
    "Action": "string name, Param[] parameters, Tree preconditions, Tree effects",
    "DurativeAction": "string name, Param[] parameters, Tree at_start_requirements,"
    " Tree over_all_requirements, Tree at_end_requirements, Tree at_start_effects, Tree at_end_effects",
    "Derived": "Node predicate, Tree preconditions",
    "PlanItem": "float32 time, string action, float32 duration",
    "Plan": "PlanItem[] items",
    "ActionExecutionInfo": "int8 status, builtin_interfaces/Time start_stamp,"
    " builtin_interfaces/Time status_stamp, string action_full_name, string action, string[] arguments,"
    " builtin_interfaces/Duration duration, float32 completion, string message_status",
}
EXECUTE_PLAN: Final = f"{PACKAGE}/action/ExecutePlan"  # action of PlanSys2's executor

_INFOS: Final = "ActionExecutionInfo[] action_execution_status"
_SERVICES: Final = {
    "AddProblem": ("string problem", _DONE),
    "AddProblemGoal": ("Tree tree", _DONE),
    "AffectNode": ("Node node", _DONE),
    "AffectParam": ("Param param", _DONE),
    "ClearProblemKnowledge": (_EMPTY, _DONE),
    "RemoveProblemGoal": (_EMPTY, _DONE),
    "ExistNode": ("Node node", "bool exist"),
    "GetDomain": (_EMPTY, "bool success, string domain, string error_info"),
    "GetDomainName": (_EMPTY, "bool success, string name, string error_info"),
    "GetDomainTypes": (_EMPTY, "bool success, string[] types, string error_info"),
    "GetDomainActions": (_EMPTY, "bool success, string[] actions, string error_info"),
    "GetDomainConstants": ("string type", "bool success, string[] constants, string error_info"),
    "GetDomainActionDetails": ("string action, string[] parameters", f"Action action, {_DONE}"),
    "GetDomainDurativeActionDetails": (
        "string durative_action, string[] parameters",
        "bool success, DurativeAction durative_action, string error_info",
    ),
    "GetDomainDerivedPredicateDetails": ("string predicate", f"Derived[] predicates, {_DONE}"),
    "GetNodeDetails": ("string expression", "bool success, Node node, string error_info"),
    "GetStates": (_EMPTY, "bool success, Node[] states, string error_info"),
    "GetProblem": (_EMPTY, "bool success, string problem, string error_info"),
    "GetProblemGoal": (_EMPTY, "bool success, Tree tree, string error_info"),
    "GetProblemInstanceDetails": ("string instance", "bool success, Param instance, string error_info"),
    "GetProblemInstances": (_EMPTY, "bool success, Param[] instances, string error_info"),
    "IsProblemGoalSatisfied": ("Tree tree", "bool success, bool satisfied, string error_info"),
    "GetPlan": ("string domain, string problem", "bool success, Plan plan, string error_info"),
    "ValidateDomain": ("string domain", _DONE),
}


def _lines(fields: str) -> str:
    return fields.replace(", ", "\n")


# Text of each definition by type.
TYPES: Final[Mapping[str, str]] = {
    EXECUTE_PLAN: f"Plan plan\n---\nbool success\n{_INFOS}\n---\n{_INFOS}",
    **{f"{PACKAGE}/msg/{name}": _lines(fields) for name, fields in _MESSAGES.items()},
    **{
        f"{PACKAGE}/srv/{name}": f"{_lines(request)}\n---\n{_lines(response)}"
        for name, (request, response) in _SERVICES.items()
    },
}


# --- names and types of services and topics -----------------------------------------------------------------

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

# Distributions whose PlanSys2 has no derived predicates, and numbers the kinds of nodes in another way.
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
    missing = SINCE_JAZZY if distribution in BEFORE_JAZZY else ()
    return {name: SERVICES[name] for name in NODES[node] if name not in missing}


# Topic for notifications about changes.
UPDATE: Final = ("/problem_expert/update_notify", "std_msgs/msg/Empty")

# Topic with the whole knowledge.
KNOWLEDGE: Final = ("/problem_expert/knowledge", f"{PACKAGE}/msg/Knowledge")

TOPIC_DEPTH: Final = 100  # queue depth of both topics
