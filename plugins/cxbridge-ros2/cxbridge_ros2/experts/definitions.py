"""PlanSys2's services and topics: their names, their types, and the definitions of the types.

The definitions are for machines without PlanSys2's package. They are the same since Humble, except the types
about derived predicates and the validation of domains, which Jazzy added.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

PACKAGE: Final = "plansys2_msgs"

# Here and below, the fields of a message, a request or a response are separated by commas.
_EMPTY_REQUEST: Final = "std_msgs/Empty request"
_DONE_RESPONSE: Final = "bool success, string error_info"

# The fields of each message, by the last part of its type.
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
}

# The fields of request and response of each service, by the last part of its type.
_SERVICES: Final = {
    "AddProblem": ("string problem", _DONE_RESPONSE),
    "AddProblemGoal": ("Tree tree", _DONE_RESPONSE),
    "AffectNode": ("Node node", _DONE_RESPONSE),
    "AffectParam": ("Param param", _DONE_RESPONSE),
    "ClearProblemKnowledge": (_EMPTY_REQUEST, _DONE_RESPONSE),
    "RemoveProblemGoal": (_EMPTY_REQUEST, _DONE_RESPONSE),
    "ExistNode": ("Node node", "bool exist"),
    "GetDomain": (_EMPTY_REQUEST, "bool success, string domain, string error_info"),
    "GetDomainName": (_EMPTY_REQUEST, "bool success, string name, string error_info"),
    "GetDomainTypes": (_EMPTY_REQUEST, "bool success, string[] types, string error_info"),
    "GetDomainActions": (_EMPTY_REQUEST, "bool success, string[] actions, string error_info"),
    "GetDomainConstants": ("string type", "bool success, string[] constants, string error_info"),
    "GetDomainActionDetails": ("string action, string[] parameters", f"Action action, {_DONE_RESPONSE}"),
    "GetDomainDurativeActionDetails": (
        "string durative_action, string[] parameters",
        "bool success, DurativeAction durative_action, string error_info",
    ),
    "GetDomainDerivedPredicateDetails": ("string predicate", f"Derived[] predicates, {_DONE_RESPONSE}"),
    "GetNodeDetails": ("string expression", "bool success, Node node, string error_info"),
    "GetStates": (_EMPTY_REQUEST, "bool success, Node[] states, string error_info"),
    "GetProblem": (_EMPTY_REQUEST, "bool success, string problem, string error_info"),
    "GetProblemGoal": (_EMPTY_REQUEST, "bool success, Tree tree, string error_info"),
    "GetProblemInstanceDetails": ("string instance", "bool success, Param instance, string error_info"),
    "GetProblemInstances": (_EMPTY_REQUEST, "bool success, Param[] instances, string error_info"),
    "IsProblemGoalSatisfied": ("Tree tree", "bool success, bool satisfied, string error_info"),
    "GetPlan": ("string domain, string problem", "bool success, Plan plan, string error_info"),
    "ValidateDomain": ("string domain", _DONE_RESPONSE),
}


def _split_fields(fields: str) -> str:
    """Return fields on separate lines, as in a file."""
    return fields.replace(", ", "\n")


# The definition of each type, in the format of .msg and .srv files.
TYPE_DEFINITIONS: Final[Mapping[str, str]] = {
    **{f"{PACKAGE}/msg/{name}": _split_fields(fields) for name, fields in _MESSAGES.items()},
    **{
        f"{PACKAGE}/srv/{name}": f"{_split_fields(request)}\n---\n{_split_fields(response)}"
        for name, (request, response) in _SERVICES.items()
    },
}


# --- names and types of services and topics -----------------------------------------------------------------

# The services of each node, with the last part of their types.
SERVICES_BY_NODE: Final[Mapping[str, Mapping[str, str]]] = {
    "problem": {
        "/problem_expert/add_problem": "AddProblem",
        "/problem_expert/add_problem_goal": "AddProblemGoal",
        "/problem_expert/add_problem_instance": "AffectParam",
        "/problem_expert/add_problem_predicate": "AffectNode",
        "/problem_expert/add_problem_function": "AffectNode",
        "/problem_expert/get_problem": "GetProblem",
        "/problem_expert/get_problem_goal": "GetProblemGoal",
        "/problem_expert/get_problem_instance": "GetProblemInstanceDetails",
        "/problem_expert/get_problem_instances": "GetProblemInstances",
        "/problem_expert/get_problem_predicate": "GetNodeDetails",
        "/problem_expert/get_problem_predicates": "GetStates",
        "/problem_expert/get_problem_function": "GetNodeDetails",
        "/problem_expert/get_problem_functions": "GetStates",
        "/problem_expert/is_problem_goal_satisfied": "IsProblemGoalSatisfied",
        "/problem_expert/remove_problem_goal": "RemoveProblemGoal",
        "/problem_expert/clear_problem_knowledge": "ClearProblemKnowledge",
        "/problem_expert/remove_problem_instance": "AffectParam",
        "/problem_expert/remove_problem_predicate": "AffectNode",
        "/problem_expert/remove_problem_function": "AffectNode",
        "/problem_expert/exist_problem_predicate": "ExistNode",
        "/problem_expert/exist_problem_function": "ExistNode",
        "/problem_expert/update_problem_function": "AffectNode",
    },
    "domain": {
        "/domain_expert/get_domain": "GetDomain",
        "/domain_expert/get_domain_name": "GetDomainName",
        "/domain_expert/get_domain_types": "GetDomainTypes",
        "/domain_expert/get_domain_constants": "GetDomainConstants",
        "/domain_expert/get_domain_actions": "GetDomainActions",
        "/domain_expert/get_domain_action_details": "GetDomainActionDetails",
        "/domain_expert/get_domain_durative_actions": "GetDomainActions",
        "/domain_expert/get_domain_durative_action_details": "GetDomainDurativeActionDetails",
        "/domain_expert/get_domain_predicates": "GetStates",
        "/domain_expert/get_domain_predicate_details": "GetNodeDetails",
        "/domain_expert/get_domain_functions": "GetStates",
        "/domain_expert/get_domain_function_details": "GetNodeDetails",
        "/domain_expert/get_domain_derived_predicates": "GetStates",
        "/domain_expert/get_domain_derived_predicate_details": "GetDomainDerivedPredicateDetails",
    },
    "planner": {"/planner/get_plan": "GetPlan", "/planner/validate_domain": "ValidateDomain"},
}

# Distributions whose PlanSys2 lacks derived predicates and numbers the operators in trees differently.
BEFORE_JAZZY: Final = ("humble", "iron")

# Services added by Jazzy; older packages lack some of their types.
SINCE_JAZZY: Final = (
    "/domain_expert/get_domain_derived_predicates",
    "/domain_expert/get_domain_derived_predicate_details",
    "/planner/validate_domain",
)

# The types of all services by name.
SERVICE_TYPES: Final = {
    name: f"{PACKAGE}/srv/{service_type}"
    for services in SERVICES_BY_NODE.values()
    for name, service_type in services.items()
}


def find_service_types(node: str, distribution: str) -> Mapping[str, str]:
    """Return the types of a node's services in a distribution, by name.

    :param node: a key of :data:`SERVICES_BY_NODE`.
    """
    missing_services = SINCE_JAZZY if distribution in BEFORE_JAZZY else ()
    return {name: SERVICE_TYPES[name] for name in SERVICES_BY_NODE[node] if name not in missing_services}


# The topic for notifications about changes, whose messages have no fields.
UPDATE_TOPIC_AND_TYPE: Final = ("/problem_expert/update_notify", "std_msgs/msg/Empty")

# The topic with the whole knowledge.
KNOWLEDGE_TOPIC_AND_TYPE: Final = ("/problem_expert/knowledge", f"{PACKAGE}/msg/Knowledge")

TOPIC_DEPTH: Final = 100  # queue depth of both topics, as in PlanSys2
