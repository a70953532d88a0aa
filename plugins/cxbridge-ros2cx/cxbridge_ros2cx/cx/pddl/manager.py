"""The node ``pddl_manager``: services that change PDDL problems, and an action that plans.

A topic names the problems that have changed. On the virtual clock, the node joins when an agent creates a
client of one of its services. On a real clock, the node of the extension ``cx_pddl`` of the ROS 2 CX offers
the services.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cxbridge.closing import Closing
from cxbridge.errors import PddlError, Ros2Error
from cxbridge.extras import install_command
from cxbridge.rights import Right
from cxbridge_planning import PlanningService
from cxbridge_planning.planner import PlanStatus
from cxbridge_planning.service.service import PlanRequest
from cxbridge_ros2.actions import GoalHandler, GoalResponse, GoalServer, GoalStatus, ServedGoal
from cxbridge_ros2cx.cx.pddl.problem import ManagedGoal, ManagedProblem
from cxbridge_ros2cx.cx.ros.handlers import wrap_handler

if TYPE_CHECKING:
    from cxbridge.clock import Clock
    from cxbridge.events import Logger
    from cxbridge.executive.pddl.ast import Ground
    from cxbridge.history.plan_steps import PlannedAction
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2.node import Node

NODE_NAME: Final = "/pddl_manager"
# goals that may wait for the planner, since peers decide how many they send; additional goals are rejected
MAX_WAITING_GOALS: Final = 64

# errors with the texts of the ROS 2 CX
_UNKNOWN_INSTANCE: Final = "Unknown pddl instance"
_UNKNOWN_TYPE: Final = "Type not in instance"

# actions that start within this time of the first action of a class are in that equivalence class, as in the
# ROS 2 CX
_MAX_CLASS_GAP_S: Final = 0.1

# the starts of expressions, statements and comments of jinja2
_TEMPLATE_MARKS: Final = ("{{", "{%", "{#")

Fields = Mapping[str, Any]  # fields of a response; missing fields have the defaults of their types


class PddlManager(GoalHandler, Closing):
    """The node ``pddl_manager``.

    :param node: the node's connection to ROS.
    :param package: the package with the types of the services: the package of the extension, or an agent's
        package with copies of earlier types.
    """

    def __init__(self, node: Node, clock: Clock, log: Logger, package: str) -> None:
        self._node, self._log = node, log
        self._problems: dict[str, ManagedProblem] = {}
        self._planning: PlanningService | None = None
        self._waiting_goals: deque[ServedGoal] = deque()
        for service, (service_type, handler) in self._list_service_handlers().items():
            with suppress(Ros2Error):  # packages with earlier types lack some services
                node.serve(
                    f"{NODE_NAME}/{service}",
                    f"{package}/srv/{service_type}",
                    wrap_handler(handler, self._log_error),
                    right=Right.CONTROL,
                )
        self._update_publisher = node.create_publisher(f"{NODE_NAME}/instance_update", "std_msgs/msg/String")
        self._goal_server = GoalServer(
            node, f"{NODE_NAME}/temp_plan", f"{package}/action/PlanTemporal", self, clock
        )

    def _list_service_handlers(self) -> dict[str, tuple[str, Callable[[Message], Fields]]]:
        """Return the type and the handler of each service."""
        change_items = self._change_items
        return {
            "add_pddl_instance": ("AddPddlInstance", self._add_instance),
            "check_action_condition": ("CheckActionCondition", self._check_condition),
            "check_action_precondition": ("CheckActionPrecondition", self._check_condition),
            "get_action_effects": ("GetActionEffects", self._get_action_effects),
            "get_action_names": ("GetActionNames", self._get_action_names),
            "get_fluents": ("GetFluents", self._get_fluents),
            "add_fluents": (
                "AddFluents",
                partial(change_items, "fluents", ManagedProblem.add_fluent, ("name", "args")),
            ),
            "rm_fluents": (
                "RemoveFluents",
                partial(change_items, "fluents", ManagedProblem.remove_fluent, ("name", "args")),
            ),
            "add_objects": (
                "AddObjects",
                partial(change_items, "objects", ManagedProblem.add_object, ("name", "type")),
            ),
            "rm_objects": (
                "RemoveObjects",
                partial(change_items, "objects", ManagedProblem.remove_object, ("name",)),
            ),
            "set_functions": (
                "SetFunctions",
                partial(change_items, "functions", ManagedProblem.set_function, ("name", "args", "value")),
            ),
            "get_functions": ("GetFunctions", self._get_functions),
            "set_goals": ("SetGoals", self._set_goals),
            "clear_goals": ("ClearGoals", self._clear_goals),
            "set_action_filter": ("SetActionFilter", partial(self._set_filter, "actions")),
            "set_object_filter": ("SetObjectFilter", partial(self._set_filter, "objects")),
            "set_fluent_filter": ("SetFluentFilter", partial(self._set_filter, "fluents")),
            "create_goal_instance": ("CreateGoalInstance", self._create_goal),
            "get_predicates": ("GetPredicates", self._get_predicates),
            "get_type_objects": ("GetTypeObjects", self._get_type_objects),
        }

    def _log_error(self, text: str) -> None:
        # agents ask for instances that may not exist yet
        if text != _UNKNOWN_INSTANCE:
            self._log.error(text)

    def _find_problem(self, name: str) -> ManagedProblem:
        if name not in self._problems:
            raise PddlError(_UNKNOWN_INSTANCE)
        return self._problems[name]

    # --- problems -----------------------------------------------------------------------------------------

    def _add_instance(self, request: Message) -> Fields:
        folder, name = Path(request["directory"]), request["name"]
        if name in self._problems:
            self._log.warn(f"Overriding problem {name}")
        domain, problem = (_read_template(folder, request[key]) for key in ("domain_file", "problem_file"))
        self._problems[name] = ManagedProblem(domain, problem, str(folder / request["domain_file"]))
        return {}

    def _change_items(
        self, field: str, change: Callable[..., None], keys: tuple[str, ...], request: Message
    ) -> Fields:
        """Change a problem by each item of a request; an invalid item does not stop the other changes.

        :param field: the field of the request that lists the items.
        :param change: gets the problem of an item, and the values of the item.
        :param keys: the names of these values.
        """
        errors = []
        for item in request[field]:
            try:
                change(self._find_problem(item["pddl_instance"]), *(item[key] for key in keys))
            except PddlError as error:
                errors.append(error.message)
        # as in the ROS 2 CX, the update names only the problem of the first item, if there is any item
        for item in request[field][:1]:
            self._update_publisher.publish({"data": item["pddl_instance"]})
        return {"success": not errors, "error": " ".join(errors)}

    def _get_fluents(self, request: Message) -> Fields:
        name = request["pddl_instance"]
        return {"fluents": [_make_common_fields(name, ground) for ground in self._find_problem(name).fluents]}

    def _get_functions(self, request: Message) -> Fields:
        name = request["pddl_instance"]
        return {
            "functions": [
                {**_make_common_fields(name, ground), "value": value}
                for ground, value in self._find_problem(name).functions.items()
            ]
        }

    def _get_predicates(self, request: Message) -> Fields:
        problem_name = request["pddl_instance"]
        return {
            "predicates": [
                {
                    "pddl_instance": problem_name,
                    "name": predicate.name,
                    "param_types": [
                        group.types[0] if group.types else "object"
                        for group in predicate.parameters
                        for _ in group.names
                    ],
                    "param_names": [name for group in predicate.parameters for name in group.names],
                }
                for predicate in self._find_problem(problem_name).domain.predicates
            ]
        }

    def _get_type_objects(self, request: Message) -> Fields:
        problem = self._find_problem(request["pddl_instance"])
        if not problem.has_type(request["type"]):
            raise PddlError(_UNKNOWN_TYPE)
        return {"objects": problem.find_objects((request["type"],))}

    # --- actions ------------------------------------------------------------------------------------------

    def _get_action_names(self, request: Message) -> Fields:
        return {
            "action_names": [
                action.name for action in self._find_problem(request["pddl_instance"]).domain.actions
            ]
        }

    def _check_condition(self, request: Message) -> Fields:
        action = request["action"]
        unsatisfied_conditions = self._find_problem(action["pddl_instance"]).find_unsatisfied_conditions(
            action["name"], action["args"]
        )
        return {"sat": not unsatisfied_conditions, "unsatisfied_conditions": unsatisfied_conditions}

    def _get_action_effects(self, request: Message) -> Fields:
        action = request["action"]
        name = action["pddl_instance"]
        fluents, functions = [], []
        for change in self._find_problem(name).list_action_changes(action["name"], action["args"]):
            fluent, time_point = _make_common_fields(name, change.ground), change.time_point
            if change.operator:
                functions.append(
                    {
                        "function": fluent,
                        "time_point": time_point,
                        "operator_type": change.operator,
                        "value": change.value,
                    }
                )
            else:
                fluents.append({"fluent": fluent, "time_point": time_point, "value": bool(change.value)})
        return {"fluent_effects": fluents, "function_effects": functions}

    # --- goals --------------------------------------------------------------------------------------------

    def _create_goal(self, request: Message) -> Fields:
        self._find_problem(request["pddl_instance"]).goals[request["goal_instance"]] = ManagedGoal()
        return {}

    def _set_goals(self, request: Message) -> Fields:
        goal = request["goal_instance"]
        for item in request["fluents"]:
            self._find_problem(item["pddl_instance"]).add_goal_fluent(goal, item["name"], item["args"])
        for item in request["functions"]:
            self._find_problem(item["pddl_instance"]).add_goal_function(
                goal, item["name"], item["args"], item["value"]
            )
        return {}

    def _clear_goals(self, request: Message) -> Fields:
        self._find_problem(request["pddl_instance"]).find_goal(request["goal_instance"]).formulas.clear()
        return {}

    def _set_filter(self, field: str, request: Message) -> Fields:
        goal = self._find_problem(request["pddl_instance"]).find_goal(request["goal_instance"])
        setattr(goal, f"kept_{field}", tuple(request[field]))
        return {}

    # --- planning -----------------------------------------------------------------------------------------

    def decide(self, served_goal: ServedGoal) -> GoalResponse:
        """Reject a goal while :data:`MAX_WAITING_GOALS` goals wait."""
        return (
            super().decide(served_goal)
            if len(self._waiting_goals) < MAX_WAITING_GOALS
            else GoalResponse.REJECT
        )

    def begin(self, served_goal: ServedGoal) -> None:
        """Queue a goal, since its sender must receive the acceptance before the result."""
        self._waiting_goals.append(served_goal)

    def plan_waiting_goals(self) -> None:
        """Plan for the waiting goals; planning takes no virtual time."""
        while self._waiting_goals:
            served_goal = self._waiting_goals.popleft()
            # as in the ROS 2 CX, the action succeeds without a plan, too: its result tells the difference
            served_goal.finish(GoalStatus.SUCCEEDED, self._plan_goal(served_goal.goal))

    def _plan_goal(self, goal: Message) -> Fields:
        name, goal_name = goal["pddl_instance"], goal["goal_instance"]
        goal_text = f"for the goal '{goal_name}' of '{name}'"
        self._log.info(f"Start planning {goal_text}...")
        if self._planning is None:
            self._planning = PlanningService(at_once=1)  # plan_waiting_goals plans one goal after another
        try:
            domain, problem = self._find_problem(name).filter_problem(goal_name, f"{name}_{goal_name}")
        except PddlError as error:
            self._log.error(f"Cannot plan {goal_text}: {error}")
            return {"success": False}
        result = self._planning.plan(PlanRequest(domain, problem))
        if result.status is not PlanStatus.PLANNED:
            self._log.warn(f"No plan {goal_text}: {result.message}")
            return {"success": False}
        self._log.info(f"Successfully planned {goal_text}, by {result.planner} in {result.seconds:.1f} s")
        return {"success": True, "actions": list(_add_times(result.actions, name, goal_name))}

    def close(self) -> None:
        self._goal_server.close()
        if self._planning is not None:
            self._planning.close()
        self._node.close()


def _make_common_fields(problem_name: str, ground: Ground) -> dict[str, Any]:
    """Return the fields that the messages of fluents, functions and planned actions have in common."""
    name, arguments = ground
    return {"pddl_instance": problem_name, "name": name, "args": list(arguments)}


def _add_times(actions: Iterable[PlannedAction], problem_name: str, goal_name: str) -> Iterable[Fields]:
    """Yield a plan's actions with times; actions that start at about the same time are equivalent."""
    class_number, class_start_s = 0, 0.0
    for number, action in enumerate(actions):
        # a plan without times gets steps of a second, so that its actions are in different classes
        start_s = float(number) if action.start is None else action.start
        if start_s - class_start_s > _MAX_CLASS_GAP_S:
            class_number, class_start_s = class_number + 1, start_s
        yield {
            **_make_common_fields(problem_name, (action.name, action.arguments)),
            "goal_instance": goal_name,
            "start_time": start_s,
            "duration": action.duration or 0.0,
            "equiv_class": class_number,
        }


def _read_template(folder: Path, name: str) -> str:
    """Return the text of a file, rendered if the file is a jinja2 template; empty for an empty name.

    :raises PddlError: if the file is unreadable, or a template that is invalid or needs a missing jinja2.
    """
    if not name:
        return ""
    file = folder / name
    try:
        text = file.read_text("utf-8", "replace")
    except OSError as error:
        raise PddlError(f"cannot read the file: {error.strerror}", file=file) from None
    if not any(mark in text for mark in _TEMPLATE_MARKS):
        return text
    try:
        from jinja2 import FileSystemLoader, TemplateError  # noqa: PLC0415 - few domains are templates
        from jinja2.sandbox import SandboxedEnvironment  # noqa: PLC0415 - likewise
    except ModuleNotFoundError:
        raise PddlError(
            "the file is a jinja2 template, and jinja2 is not installed",
            file=file,
            hint=install_command("pddl", "cxbridge-ros2cx"),
        ) from None
    try:
        return str(SandboxedEnvironment(loader=FileSystemLoader(folder)).get_template(name).render())
    except TemplateError as error:
        raise PddlError(
            f"the template is invalid: {error}", file=file, line=getattr(error, "lineno", None)
        ) from None
