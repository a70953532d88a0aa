"""The services of PlanSys2's problem expert by name, each with its handler.

:class:`ExpertService` also describes the services of the domain expert.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from msgspec import Struct

from cxbridge.errors import PddlError, Ros2Error
from cxbridge.executive.pddl.ast import Ground
from cxbridge.executive.pddl.problems import format_problem
from cxbridge_ros2.experts.knowledge import ProblemExpert, format_ground, split_words
from cxbridge_ros2.experts.trees import (
    TreeCodec,
    TreeNodeKind,
    make_ground_node,
    make_param,
    parse_ground_node,
)
from cxbridge_ros2.messages import Message

# Handles a request and returns the fields of the response besides `success`; None if there are none.
ServiceHandler = Callable[[ProblemExpert, TreeCodec, Message], Mapping[str, Any] | None]


class ExpertService(Struct, frozen=True):
    """A service of an expert.

    :param handle: handles a request; `PddlError` and `Ros2Error` become the error in the response.
    :param error_prefix: PlanSys2's text before an error.
    :param changes_problem: whether the service changes the problem.
    """

    handle: ServiceHandler
    error_prefix: str = "Error"
    changes_problem: bool = False


def make_response(
    service: ExpertService, expert: ProblemExpert, codec: TreeCodec, request: Message
) -> Mapping[str, Any]:
    """Return the response of a service to a request."""
    try:
        fields = service.handle(expert, codec, request) or {}
    except (PddlError, Ros2Error) as error:
        return {"success": False, "error_info": f"{service.error_prefix}: {error.message}"}
    return fields if "exist" in fields else {"success": True, **fields}  # ExistNode has no `success`


def make_knowledge_message(expert: ProblemExpert) -> Message:
    """Return the knowledge of an expert as a plansys2_msgs/msg/Knowledge."""
    knowledge = expert.knowledge
    return {
        "instances": [*knowledge.instances],
        "predicates": [*map(format_ground, knowledge.predicates)],
        "functions": [*map(format_ground, knowledge.functions)],
        "goal": knowledge.goal,
    }


# --- handlers that are more than an expression


def _add_problem_goal(expert: ProblemExpert, codec: TreeCodec, request: Message) -> None:
    if not request["tree"]["nodes"]:
        raise Ros2Error("Malformed expression")  # PlanSys2's text
    expert.set_goal(codec.decode_tree(request["tree"]))


def _get_instance(expert: ProblemExpert, _codec: TreeCodec, request: Message) -> Mapping[str, Any]:
    type_name = expert.instances.get(name := request["instance"])
    if type_name is None:
        raise Ros2Error(f"there is no instance '{name}'")
    return {"instance": make_param(name, type_name)}


def _get_ground(
    expert: ProblemExpert, _codec: TreeCodec, request: Message, *, kind: TreeNodeKind
) -> Mapping[str, Any]:
    values, ground = _find_values(expert, kind), _parse_ground(request["expression"])
    if ground not in values:
        complaint = "has no value" if kind is TreeNodeKind.FUNCTION else "is not true"
        raise Ros2Error(f"{format_ground(ground)} {complaint}")
    return {"node": make_ground_node(kind, ground, expert.instances, values[ground])}


def _get_grounds(
    expert: ProblemExpert, _codec: TreeCodec, _request: Message, *, kind: TreeNodeKind
) -> Mapping[str, Any]:
    types, values = expert.instances, _find_values(expert, kind)
    return {"states": [make_ground_node(kind, ground, types, value) for ground, value in values.items()]}


def _find_values(expert: ProblemExpert, kind: TreeNodeKind) -> Mapping[Ground, float]:
    """Return the values of the functions; for predicates, the true predicates with the value 0."""
    is_function, knowledge = kind is TreeNodeKind.FUNCTION, expert.knowledge
    return knowledge.functions if is_function else dict.fromkeys(knowledge.predicates, 0.0)


def _parse_ground(text: str) -> Ground:
    """Return the predicate or function in ``(at r1 home)`` or ``(= (distance a b) 3)``."""
    name, *arguments = split_words(text) or [""]
    if name == "=" and arguments:
        name, *arguments = arguments[:-1] or [""]  # without the number
    return name, tuple(arguments)


def _make_change_service(
    handle: Callable[[ProblemExpert, Message], None], error_prefix: str
) -> ExpertService:
    """Return a service that changes the problem. Its handler needs no codec and returns nothing."""
    return ExpertService(
        lambda expert, _codec, request: handle(expert, request), error_prefix, changes_problem=True
    )


# Services of the problem expert, by name.
PROBLEM_SERVICES: Final[Mapping[str, ExpertService]] = {
    "/problem_expert/add_problem": _make_change_service(
        lambda expert, request: expert.add_problem(request["problem"]), "Problem not valid"
    ),
    "/problem_expert/add_problem_goal": ExpertService(
        _add_problem_goal, "Goal not valid", changes_problem=True
    ),
    "/problem_expert/add_problem_instance": _make_change_service(
        lambda expert, request: expert.add_instance(request["param"]["name"], request["param"]["type"]),
        "Instance not valid",
    ),
    "/problem_expert/add_problem_predicate": _make_change_service(
        lambda expert, request: expert.add_predicate(parse_ground_node(request["node"])),
        "Predicate not valid",
    ),
    "/problem_expert/add_problem_function": _make_change_service(
        lambda expert, request: expert.add_function(
            parse_ground_node(request["node"]), request["node"]["value"]
        ),
        "Function not valid",
    ),
    "/problem_expert/get_problem": ExpertService(
        lambda expert, _codec, _request: {"problem": format_problem(expert.make_problem())},
        "Problem not valid",
    ),
    "/problem_expert/get_problem_goal": ExpertService(
        lambda expert, codec, _request: {"tree": codec.encode_formula(expert.goal, {})}, "Goal not valid"
    ),
    "/problem_expert/get_problem_instance": ExpertService(_get_instance, "Instance not found"),
    "/problem_expert/get_problem_instances": ExpertService(
        lambda expert, _codec, _request: {
            "instances": [make_param(name, type_name) for name, type_name in expert.instances.items()]
        }
    ),
    "/problem_expert/get_problem_predicate": ExpertService(
        partial(_get_ground, kind=TreeNodeKind.PREDICATE), "Predicate not found"
    ),
    "/problem_expert/get_problem_predicates": ExpertService(
        partial(_get_grounds, kind=TreeNodeKind.PREDICATE)
    ),
    "/problem_expert/get_problem_function": ExpertService(
        partial(_get_ground, kind=TreeNodeKind.FUNCTION), "Function not found"
    ),
    "/problem_expert/get_problem_functions": ExpertService(partial(_get_grounds, kind=TreeNodeKind.FUNCTION)),
    "/problem_expert/is_problem_goal_satisfied": ExpertService(
        # a tree without nodes stands for an empty conjunction, which is true
        lambda expert, codec, request: {
            "satisfied": not request["tree"]["nodes"]
            or expert.is_satisfied(codec.decode_tree(request["tree"]))
        },
        "Goal not valid",
    ),
    "/problem_expert/remove_problem_goal": _make_change_service(
        lambda expert, _request: expert.knowledge.put_goal(""), "Error clearing goal"
    ),
    "/problem_expert/clear_problem_knowledge": _make_change_service(
        lambda expert, _request: expert.clear(), "Error clearing knowledge"
    ),
    "/problem_expert/remove_problem_instance": _make_change_service(
        lambda expert, request: expert.remove_instance(request["param"]["name"]), "Error removing instance"
    ),
    "/problem_expert/remove_problem_predicate": _make_change_service(
        lambda expert, request: expert.remove_predicate(parse_ground_node(request["node"])),
        "Error removing predicate",
    ),
    "/problem_expert/remove_problem_function": _make_change_service(
        lambda expert, request: expert.remove_function(parse_ground_node(request["node"])),
        "Error removing function",
    ),
    "/problem_expert/exist_problem_predicate": ExpertService(
        lambda expert, _codec, request: {
            "exist": parse_ground_node(request["node"]) in expert.knowledge.predicates
        }
    ),
    "/problem_expert/exist_problem_function": ExpertService(
        lambda expert, _codec, request: {
            "exist": parse_ground_node(request["node"]) in expert.knowledge.functions
        }
    ),
    "/problem_expert/update_problem_function": _make_change_service(
        lambda expert, request: expert.update_function(
            parse_ground_node(request["node"]), request["node"]["value"]
        ),
        "Function not valid",
    ),
}
