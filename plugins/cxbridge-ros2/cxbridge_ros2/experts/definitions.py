"""Definitions of PlanSys2's services and topics, for machines without its package.

They are the same since Humble, except the types about derived predicates, which Jazzy added.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

PACKAGE: Final = "plansys2_msgs"

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
