"""The services of the problem expert: responses, and changes of the problem."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from msgspec import Struct

from cxbridge.errors import PddlError, Ros2Error
from cxbridge.executive.pddl.ast import Ground
from cxbridge.executive.pddl.problems import format_problem
from cxbridge_ros2.experts.knowledge import ProblemExpert, ground_text, words_of
from cxbridge_ros2.experts.nodes import NodeCodec, TreeNodeKind, ground_in, ground_node, param
from cxbridge_ros2.messages import Message

# Carries out a request and returns the fields of the response besides `success`.
Work = Callable[[ProblemExpert, NodeCodec, Message], Mapping[str, Any] | None]


class ExpertService(Struct, frozen=True):
    """A service of an expert.

    :param failure: PlanSys2's text about a failure.
    :param changes: whether the service changes the problem.
    """

    work: Work
    failure: str = "Error"
    changes: bool = False


def answer(
    service: ExpertService, expert: ProblemExpert, codec: NodeCodec, request: Message
) -> Mapping[str, Any]:
    """Return the response of a service to a request."""
    try:
        fields = service.work(expert, codec, request) or {}
    except (PddlError, Ros2Error) as error:
        return {"success": False, "error_info": f"{service.failure}: {error.message}"}
    return fields if "exist" in fields else {"success": True, **fields}  # ExistNode has no `success`


def knowledge_message(expert: ProblemExpert) -> Message:
    """Return the knowledge as plansys2_msgs/msg/Knowledge."""
    knowledge = expert.knowledge
    return {
        "instances": [*knowledge.instances],
        "predicates": [*map(ground_text, knowledge.predicates)],
        "functions": [*map(ground_text, knowledge.functions)],
        "goal": knowledge.goal,
    }


# --- services with more than one expression


def _add_goal(expert: ProblemExpert, codec: NodeCodec, request: Message) -> None:
    if not request["tree"]["nodes"]:
        raise Ros2Error("Malformed expression")
    expert.set_goal(codec.formula(request["tree"]))


def _get_instance(expert: ProblemExpert, _codec: NodeCodec, request: Message) -> Mapping[str, Any]:
    kind = expert.instances.get(name := request["instance"])
    if kind is None:
        raise Ros2Error(f"there is no '{name}'")
    return {"instance": param(name, kind)}


def _get_predicate(expert: ProblemExpert, _codec: NodeCodec, request: Message) -> Mapping[str, Any]:
    ground = _parse_ground(request["expression"])
    if ground not in expert.knowledge.predicates:
        raise Ros2Error(f"{ground_text(ground)} is not true")
    return {"node": ground_node(TreeNodeKind.PREDICATE, ground, expert.instances)}


def _get_predicates(expert: ProblemExpert, _codec: NodeCodec, _request: Message) -> Mapping[str, Any]:
    types, predicates = expert.instances, expert.knowledge.predicates
    return {"states": [ground_node(TreeNodeKind.PREDICATE, ground, types) for ground in predicates]}


def _get_function(expert: ProblemExpert, _codec: NodeCodec, request: Message) -> Mapping[str, Any]:
    functions, ground = expert.knowledge.functions, _parse_ground(request["expression"])
    if ground not in functions:
        raise Ros2Error(f"{ground_text(ground)} has no value")
    return {"node": ground_node(TreeNodeKind.FUNCTION, ground, expert.instances, functions[ground])}


def _get_functions(expert: ProblemExpert, _codec: NodeCodec, _request: Message) -> Mapping[str, Any]:
    types, functions = expert.instances, expert.knowledge.functions.items()
    return {
        "states": [ground_node(TreeNodeKind.FUNCTION, ground, types, value) for ground, value in functions]
    }


def _parse_ground(text: str) -> Ground:
    """Return the predicate or function in ``(at r1 home)`` or ``(= (distance a b) 3)``."""
    name, *arguments = words_of(text) or [""]
    if name == "=" and arguments:
        name, *arguments = arguments[:-1] or [""]
    return name, tuple(arguments)


def _change(work: Callable[[ProblemExpert, Message], None], failure: str) -> ExpertService:
    """Return a service that changes the problem, and whose request has no formulas."""
    return ExpertService(lambda expert, _codec, request: work(expert, request), failure, changes=True)


# Services of the problem expert, by the last part of the name.
PROBLEM_SERVICES: Final[Mapping[str, ExpertService]] = {
    "add_problem": _change(
        lambda expert, request: expert.add_problem(request["problem"]), "Problem not valid"
    ),
    "add_problem_goal": ExpertService(_add_goal, "Goal not valid", changes=True),
    "add_problem_instance": _change(
        lambda expert, request: expert.add_instance(request["param"]["name"], request["param"]["type"]),
        "Instance not valid",
    ),
    "add_problem_predicate": _change(
        lambda expert, request: expert.add_predicate(ground_in(request["node"])), "Predicate not valid"
    ),
    "add_problem_function": _change(
        lambda expert, request: expert.add_function(ground_in(request["node"]), request["node"]["value"]),
        "Function not valid",
    ),
    "get_problem": ExpertService(
        lambda expert, _codec, _request: {"problem": format_problem(expert.problem())}, "Problem not valid"
    ),
    "get_problem_goal": ExpertService(
        lambda expert, codec, _request: {"tree": codec.tree(expert.goal, {})}, "Goal not valid"
    ),
    "get_problem_instance": ExpertService(_get_instance, "Instance not found"),
    "get_problem_instances": ExpertService(
        lambda expert, _codec, _request: {"instances": [param(*pair) for pair in expert.instances.items()]}
    ),
    "get_problem_predicate": ExpertService(_get_predicate, "Predicate not found"),
    "get_problem_predicates": ExpertService(_get_predicates),
    "get_problem_function": ExpertService(_get_function, "Function not found"),
    "get_problem_functions": ExpertService(_get_functions),
    "is_problem_goal_satisfied": ExpertService(
        # no nodes: an empty conjunction, which is true
        lambda expert, codec, request: {
            "satisfied": not request["tree"]["nodes"] or expert.is_satisfied(codec.formula(request["tree"]))
        },
        "Goal not valid",
    ),
    "remove_problem_goal": _change(
        lambda expert, _request: expert.knowledge.put_goal(""), "Error clearing goal"
    ),
    "clear_problem_knowledge": _change(lambda expert, _request: expert.clear(), "Error clearing knowledge"),
    "remove_problem_instance": _change(
        lambda expert, request: expert.remove_instance(request["param"]["name"]), "Error removing instance"
    ),
    "remove_problem_predicate": _change(
        lambda expert, request: expert.remove_predicate(ground_in(request["node"])),
        "Error removing predicate",
    ),
    "remove_problem_function": _change(
        lambda expert, request: expert.remove_function(ground_in(request["node"])), "Error removing function"
    ),
    "exist_problem_predicate": ExpertService(
        lambda expert, _codec, request: {"exist": ground_in(request["node"]) in expert.knowledge.predicates}
    ),
    "exist_problem_function": ExpertService(
        lambda expert, _codec, request: {"exist": ground_in(request["node"]) in expert.knowledge.functions}
    ),
    "update_problem_function": _change(
        lambda expert, request: expert.update_function(ground_in(request["node"]), request["node"]["value"]),
        "Function not valid",
    ),
}
